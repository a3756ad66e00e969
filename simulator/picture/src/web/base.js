"use strict";

/* Shared by all scripts: elements, numbers, data. Scripts are loaded in order and share this object. */
const Report = {};

/* An element with attributes and children; text is never read as markup. */
Report.element = function (tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  return Report.fill(element, attributes, children);
};

Report.svg = function (tag, attributes = {}, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  return Report.fill(element, attributes, children);
};

Report.fill = function (element, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === true) element.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
};

/* The JSON in the element with this id; null where there is none. */
Report.data = function (id) {
  const element = document.getElementById(id);
  return element ? JSON.parse(element.textContent) : null;
};

/* 16-bit numbers from base64, little-endian. */
Report.numbers = function (base64) {
  const text = atob(base64);
  const values = new Uint16Array(text.length / 2);
  for (let i = 0; i < values.length; i++) values[i] = text.charCodeAt(2 * i) | (text.charCodeAt(2 * i + 1) << 8);
  return values;
};

/* A number with at most `digits` digits, as short as possible. */
Report.short = function (value, digits = 4) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) return value.toExponential(Math.max(0, digits - 2)).replace(/\.?0*e\+?/, "e");
  return String(Number(value.toPrecision(digits)));
};

/* A colour of the style sheet. */
Report.color = function (name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
};

/* Calls `draw` when the colours change: between light and dark, and for a printer. */
Report.onTheme = function (draw) {
  for (const media of ["(prefers-color-scheme: dark)", "print"]) matchMedia(media).addEventListener("change", draw);
};
