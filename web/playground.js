"use strict";

/* The playground: a scene in an editor, and its runs, which the worker takes the steps of. */

class Playground {
  /* Milliseconds from the last key to the run, and of a step at most. */
  static WAIT = 250;
  static LONGEST = 5000;
  /* Characters of a scene that an address holds. */
  static SHARED = 1 << 20;

  constructor() {
    for (const id of ["scene", "share", "shared", "lines", "text", "offers", "problem", "live", "status"]) this[id] = document.getElementById(id);
    this.number = 0;
    this.asked = new Map();
    this.start();
  }

  async start() {
    try {
      const digits = Uint8Array.from(atob(document.getElementById("scenes").textContent), (digit) => digit.charCodeAt(0));
      this.scenes = await (await Program.unpack(digits, "gzip")).json();
      this.completion = new Completion(Object.values(this.scenes));
      this.list();
      this.hear();
      await this.restart();
    } catch (error) {
      this.tell(`The simulator could not be loaded: ${error.message}\nThis page needs a browser of 2023 or later.`);
      return;
    }
    await this.follow();
    document.documentElement.dataset.state = "ready";
  }

  /* The scene of the address, or the first one. */
  async follow() {
    const shared = new URLSearchParams(location.hash.slice(1)).get("scene");
    try {
      if (shared) {
        await this.put(await Playground.decode(shared));
        return;
      }
    } catch {
      if (!this.text.value) await this.put(Object.values(this.scenes)[0]);
      this.tell("The scene in the address is damaged.");
      return;
    }
    await this.put(Object.values(this.scenes)[0]);
  }

  list() {
    const groups = new Map();
    for (const name of Object.keys(this.scenes)) {
      const [group, scene] = name.split("/");
      if (!groups.has(group)) groups.set(group, Report.element("optgroup", { label: group }));
      groups.get(group).append(Report.element("option", { value: name }, scene));
    }
    this.scene.append(...groups.values());
  }

  hear() {
    this.scene.addEventListener("change", () => this.scene.value && this.put(this.scenes[this.scene.value]));
    this.share.addEventListener("click", () => this.give());
    this.text.addEventListener("input", () => {
      this.scene.value = "";
      this.shared.textContent = "";
      this.edited();
    });
    this.text.addEventListener("scroll", () => { this.lines.scrollTop = this.text.scrollTop; });
    for (const event of ["keyup", "click", "focus"]) this.text.addEventListener(event, () => this.offer());
    this.text.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" || !event.ctrlKey) return;
      event.preventDefault();
      this.offers.querySelector("button")?.click();
    });
    addEventListener("hashchange", () => this.follow());
  }

  /* A worker; one that is at work is given up. */
  async restart() {
    this.worker?.terminate();
    for (const { fail } of this.asked.values()) fail(new Error("the step was given up"));
    this.asked.clear();
    let opened;
    const ready = new Promise((resolve) => { opened = resolve; });
    this.worker = await Program.start((data) => (data.ready ? opened() : this.answer(data)), (words) => this.tell(`The simulator failed: ${words}`));
    await ready;
  }

  /* The bytes that the worker answers a request with. */
  ask(request) {
    const number = ++this.number;
    return new Promise((take, fail) => {
      const late = setTimeout(() => {
        this.running?.close();
        this.running = null;
        this.tell(`A step takes longer than ${Playground.LONGEST / 1000} s, and was given up. The program simulate runs this scene, or change it.`);
        this.restart();
      }, Playground.LONGEST);
      this.asked.set(number, { take, fail, late });
      this.worker.postMessage({ number, ...request });
    });
  }

  answer({ number, bytes, error, fault }) {
    const { take, fail, late } = this.asked.get(number) ?? {};
    if (!take) return;
    clearTimeout(late);
    this.asked.delete(number);
    if (bytes) {
      take(bytes);
      return;
    }
    fail(new Error(error ?? fault));
    if (fault) this.restart();
  }

  put(text) {
    this.text.value = text;
    this.text.setSelectionRange(0, 0);
    this.text.scrollTop = 0;
    this.edited();
    clearTimeout(this.waiting);
    return this.open();
  }

  edited() {
    this.numberLines();
    this.offer();
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => this.open(), Playground.WAIT);
  }

  /* Runs the scene of the editor; one with an error leaves the run as it is. */
  async open() {
    const text = this.text.value;
    let answer;
    try {
      answer = new TextDecoder().decode(await this.ask({ open: text }));
    } catch (error) {
      if (text === this.text.value && this.problem.hidden) this.tell(`The scene could not be opened: ${error.message}`);
      return;
    }
    if (text !== this.text.value) return;
    const [remarks, data] = answer.split("\n", 2);
    const { error, warnings } = JSON.parse(remarks);
    this.show(error ? [error] : warnings, Boolean(error));
    document.documentElement.dataset.scene = error ? "refused" : "open";
    if (error) return;
    const opened = JSON.parse(data);
    opened.scene.fixed = opened.fixed;
    const { playing, panes } = this.running ?? {};
    this.running?.close();
    this.status.hidden = true;
    this.running = new Report.Live(this.live, opened, (request) => this.ask({ frame: request }));
    if (panes?.length === 2) this.running.host.querySelector("input[name=second]").click();
    if (playing) this.running.play();
  }

  /* Errors or warnings, and their lines. */
  show(remarks, bad) {
    this.problem.hidden = !remarks.length;
    this.problem.classList.toggle("bad", bad);
    const words = remarks.slice(0, 5).map(({ line, column, message, help }) => {
      const place = line === null ? "" : `Line ${line}, column ${column}: `;
      return `${place}${message}\n${help[0].toUpperCase()}${help.slice(1)}.`;
    });
    this.problem.textContent = words.join("\n");
    this.numberLines(new Set(remarks.map(({ line }) => line)));
  }

  tell(words) {
    this.problem.hidden = false;
    this.problem.classList.add("bad");
    this.problem.textContent = words;
    this.status.hidden = true;
  }

  numberLines(wrong = new Set()) {
    const count = this.text.value.split("\n").length;
    const line = (number) => (wrong.has(number) ? Report.element("span", { class: "wrong" }, String(number)) : String(number));
    this.lines.replaceChildren(...Array.from({ length: count }, (_, i) => [line(i + 1), "\n"]).flat());
    this.lines.scrollTop = this.text.scrollTop;
  }

  /* Completions at the caret. */
  offer() {
    const { selectionStart: caret, selectionEnd: end, value } = this.text;
    const found = caret === end ? this.completion.at(value, caret) : null;
    const button = (name) => {
      const element = Report.element("button", { type: "button" }, name);
      element.addEventListener("click", () => this.complete(found, name));
      return element;
    };
    this.offers.replaceChildren(...(found?.names.slice(0, 24).map(button) ?? []));
  }

  complete({ from, kind }, name) {
    const { text } = this;
    const tail = { element: " ", attribute: '=""', value: "" }[kind];
    text.focus();
    text.setSelectionRange(from, text.selectionEnd);
    // Unlike setRangeText, this can be undone.
    if (!document.execCommand("insertText", false, name + tail)) text.setRangeText(name + tail, from, text.selectionEnd, "end");
    if (kind === "attribute") text.setSelectionRange(text.selectionEnd - 1, text.selectionEnd - 1);
    this.edited();
  }

  /* Puts the scene into the address. */
  async give() {
    const text = this.text.value;
    if (text.length > Playground.SHARED) {
      this.shared.textContent = "The scene is too long for an address.";
      return;
    }
    const address = new URL(location.href);
    address.hash = `scene=${await Playground.encode(text)}`;
    history.replaceState(null, "", address);
    const copied = await navigator.clipboard?.writeText(address.href).then(() => true, () => false);
    this.shared.textContent = copied ? "The address holds the scene, and is copied." : "The address of this page holds the scene.";
  }

  /* A text as letters of an address, and back. */
  static async encode(text) {
    const stream = new Blob([text]).stream().pipeThrough(new CompressionStream("deflate-raw"));
    const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
    const letters = Array.from(bytes, (byte) => String.fromCharCode(byte)).join("");
    return btoa(letters).replace(/\+/g, "-").replace(/\//g, "_").replace(/=+$/, "");
  }

  static async decode(letters) {
    const bytes = Uint8Array.from(atob(letters.replace(/-/g, "+").replace(/_/g, "/")), (letter) => letter.charCodeAt(0));
    const reader = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw")).getReader();
    const parts = [];
    for (let length = 0; ;) {
      const { done, value } = await reader.read();
      if (done) return new Blob(parts).text();
      parts.push(value);
      length += value.length;
      if (length > 4 * Playground.SHARED) throw new Error("too long");
    }
  }
}

Report.end = (error) => window.playground.tell(`The run has ended: ${error.message}`);

window.playground = new Playground();
