"use strict";

/* Takes traces that are dropped or chosen, has them graded by the worker, and shows its report. */

class Site {
  static LARGEST = 512 * 1024 * 1024;
  /* Folders of the worker. */
  static RESERVED = ["cache", "out", "tmp"];

  constructor() {
    const by = (id) => document.getElementById(id);
    Object.assign(this, {
      assignment: by("assignment"), drop: by("drop"), status: by("status"), refused: by("refused"),
      result: by("result"), text: by("text"), page: by("page"), save: by("save"),
    });
    this.number = 0;
    this.scenes = [];
    this.hear();
    this.load();
  }

  hear() {
    const by = (id) => document.getElementById(id);
    for (const kind of ["folder", "files"]) {
      by(`choose-${kind}`).addEventListener("click", () => by(kind).click());
      by(kind).addEventListener("change", (event) => {
        const chosen = [...event.target.files].map((file) => ({ path: file.webkitRelativePath || file.name, file }));
        event.target.value = "";
        if (chosen.length) this.take(chosen);
      });
    }
    // A page of the report that a link names: the frame starts anew with it.
    addEventListener("message", ({ source, data }) => {
      if (source === this.page.contentWindow && typeof data.page === "string") this.show(data.page);
    });
    const stop = (event) => event.preventDefault();
    for (const name of ["dragenter", "dragover", "dragleave", "drop"]) {
      document.addEventListener(name, (event) => {
        stop(event);
        this.drop.classList.toggle("over", name === "dragenter" || name === "dragover");
      });
    }
    document.addEventListener("drop", async (event) => {
      // Items are gone after the first wait. Of a page in a file, Chromium reads folders by handles alone.
      const items = [...event.dataTransfer.items].filter((item) => item.kind === "file").map((item) => ({
        handle: item.getAsFileSystemHandle?.(), entry: item.webkitGetAsEntry?.(), file: item.getAsFile(),
      }));
      const found = [];
      try {
        for (const item of items) await Site.collect(item, found);
      } catch (error) {
        this.refuse(`What was dropped could not be read: ${error.message} Choose it by a button.`);
        return;
      }
      if (found.length) this.take(found);
    });
    this.assignment.addEventListener("change", () => this.last && this.take(this.last));
    by("as-text").addEventListener("click", (event) => {
      this.text.hidden = !this.text.hidden;
      event.target.textContent = this.text.hidden ? "Show as text" : "Hide the text";
      event.target.setAttribute("aria-expanded", String(!this.text.hidden));
    });
    document.getElementById("grade").addEventListener("submit", stop);
  }

  /* The files of an item that was dropped. */
  static async collect({ handle, entry, file }, found) {
    const folder = await handle;
    if (folder?.kind === "directory") await Site.enter(folder, "", found);
    else if (entry?.isDirectory) await Site.walk(entry, "", found);
    else if (file) found.push({ path: file.name, file });
  }

  /* The files of a folder, by handles. */
  static async enter(folder, below, found) {
    const path = `${below}${folder.name}/`;
    for await (const inner of folder.values()) {
      if (inner.kind === "directory") await Site.enter(inner, path, found);
      else found.push({ path: `${path}${inner.name}`, file: await inner.getFile() });
    }
  }

  /* The same by entries. */
  static async walk(entry, below, found) {
    const path = `${below}${entry.name}`;
    if (entry.isFile) {
      found.push({ path, file: await new Promise((resolve, reject) => entry.file(resolve, reject)) });
      return;
    }
    const reader = entry.createReader();
    for (;;) {
      const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
      if (!some.length) return;
      for (const inner of some) await Site.walk(inner, `${path}/`, found);
    }
  }

  /* Starts the worker. */
  async load() {
    try {
      this.worker = await Program.start((data) => this.answer(data), (words) => this.refuse(`The grader failed: ${words}`));
    } catch (error) {
      this.refuse(`The grader could not be loaded: ${error.message}\nThis page needs a browser of 2023 or later.`);
    }
  }

  refuse(words) {
    this.refused.textContent = words;
    this.refused.hidden = false;
    this.status.textContent = "";
    document.documentElement.dataset.state = "refused";
  }

  /* The name of a hand-in, where its files go, and further arguments; null if a single trace names no scene. */
  place(found) {
    const [only] = found;
    const stem = only.path.split("/").pop().replace(/\.(csv|bin)$/i, "");
    if (found.length > 1 || stem === only.path.split("/").pop()) {
      const top = only.path.split("/")[0];
      const isFolder = found.every(({ path }) => path.startsWith(`${top}/`));
      const isOwn = (isFolder || found.length === 1) && !Site.RESERVED.includes(top);
      const below = isOwn ? "" : "traces/";
      return { name: isOwn ? top : "traces", found: found.map(({ path, file }) => ({ path: below + path, file })), args: [] };
    }
    const named = this.scenes.filter((scene) => scene.endsWith(`/${stem}`) || scene === stem);
    if (named.length !== 1) {
      const help = named.length ? `It is a scene of several groups: ${named.join(", ")}.` : "No scene has this name.";
      this.refuse(`${only.path}: ${help}\nDrop the folder of the group, or call the trace as its scene: GROUP/SCENE.csv.`);
      return null;
    }
    const ending = only.path.slice(only.path.lastIndexOf("."));
    return { name: "trace", found: [{ ...only, path: `trace/${named[0]}${ending}` }], args: ["--only", named[0]] };
  }

  async take(found) {
    this.last = found;
    this.result.hidden = true;
    this.refused.hidden = true;
    if (!this.ready) {
      this.waiting = found;
      return;
    }
    if (found.reduce((sum, { file }) => sum + file.size, 0) > Site.LARGEST) {
      this.refuse("The files are larger than 512 MiB together.\nDrop the folder of traces alone.");
      return;
    }
    const placed = this.place(found);
    if (!placed) return;
    document.documentElement.dataset.state = "grading";
    this.status.textContent = `${found.length} ${found.length === 1 ? "file is" : "files are"} being graded.`;
    this.began = performance.now();
    const read = async ({ path, file }) => [path, new Uint8Array(await file.arrayBuffer())];
    try {
      const files = await Promise.all(placed.found.map(read));
      const { value } = this.assignment;
      const args = [...placed.args, ...(value ? ["--assignment", value] : [])];
      this.worker.postMessage({ number: ++this.number, name: placed.name, files, args }, files.map(([, bytes]) => bytes.buffer));
    } catch (error) {
      this.refuse(`The files could not be read: ${error.message}`);
    }
  }

  /* Shows a page of the report; the first one has no name. */
  show(name) {
    if (this.address) URL.revokeObjectURL(this.address);
    this.address = URL.createObjectURL(this.report);
    this.page.src = `${this.address}${name && `#${encodeURI(name)}`}`;
    this.save.href = this.address;
  }

  answer(data) {
    if (data.number === undefined) {
      if (!data.ready) {
        this.refuse(`The grader could not be started.\n${data.error}`);
        return;
      }
      this.ready = true;
      this.scenes = data.scenes;
      for (const { name, title } of data.assignments) {
        const option = document.createElement("option");
        option.value = name;
        option.textContent = `${name}: ${title}`;
        this.assignment.append(option);
      }
      this.status.textContent = "The grader is ready.";
      document.documentElement.dataset.state = "ready";
      if (this.waiting) this.take(this.waiting);
      return;
    }
    // Another hand-in was dropped meanwhile.
    if (data.number !== this.number) return;
    const seconds = ((performance.now() - this.began) / 1000).toFixed(1);
    if (!data.page) {
      const hint = "\nPrograms run on your own machine only: there, the program grade does the same.";
      this.refuse(`${data.error.trim()}${data.error.includes("program") ? hint : ""}`);
      return;
    }
    const passed = data.status === 0;
    this.status.textContent = `${passed ? "All passed" : "Something failed"}, after ${seconds} s.`;
    this.text.textContent = data.output;
    this.report = new Blob([data.page], { type: "text/html" });
    this.show("");
    this.result.hidden = false;
    document.documentElement.dataset.state = passed ? "passed" : "failed";
    document.documentElement.dataset.seconds = seconds;
  }
}

window.site = new Site();
