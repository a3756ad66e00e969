"use strict";

/* Names that fit where the caret stands in a scene: those that scenes at hand have there. */
class Completion {
  /* `scenes` are texts of scenes. */
  constructor(scenes) {
    /* element ──> attribute ──> values */
    this.elements = new Map();
    for (const text of scenes) {
      for (const [, element, attributes] of text.replace(/<!--[^]*?-->/g, "").matchAll(/<([a-z]+)((?:\s+[\w-]+\s*=\s*(?:"[^"]*"|'[^']*'))*)\s*\/?>/g)) {
        if (!this.elements.has(element)) this.elements.set(element, new Map());
        const known = this.elements.get(element);
        for (const [, name, value] of attributes.matchAll(/([\w-]+)\s*=\s*["']([^"']*)["']/g)) {
          if (!known.has(name)) known.set(name, new Set());
          if (/^[a-z]/.test(value)) known.get(name).add(value);
        }
      }
    }
  }

  /* Completions at `caret`: { from, names, kind }, with the start of the name that is typed; null where nothing fits. */
  at(text, caret) {
    const before = text.slice(0, caret);
    const tag = before.slice(before.lastIndexOf("<"));
    if (!tag.startsWith("<") || before.lastIndexOf("<!--") > before.lastIndexOf("-->")) return null;
    const name = tag.match(/^<([a-z]*)$/);
    const offer = (kind, typed, names) => {
      const fitting = [...names].filter((each) => each.startsWith(typed) && each !== typed).sort();
      return fitting.length ? { kind, from: caret - typed.length, names: fitting } : null;
    };
    if (name) return offer("element", name[1], this.elements.keys());
    const open = tag.match(/^<([a-z]+)\s((?:[^"'<>]|"[^"]*"|'[^']*')*)$/);
    const attributes = open && this.elements.get(open[1]);
    if (attributes) {
      const typed = open[2].match(/(?:^|\s)([\w-]*)$/);
      const present = new Set([...open[2].matchAll(/([\w-]+)\s*=/g)].map(([, each]) => each));
      return typed && offer("attribute", typed[1], [...attributes.keys()].filter((each) => !present.has(each)));
    }
    const value = tag.match(/^<([a-z]+)\s[^<>]*?([\w-]+)\s*=\s*["']([\w-]*)$/);
    const values = value && this.elements.get(value[1])?.get(value[2]);
    return values ? offer("value", value[3], values) : null;
  }
}

if (typeof module !== "undefined") module.exports = Completion;
