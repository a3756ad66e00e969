"use strict";

/* Filters of tables: rows have data-verdict, sections a form with a field `verdict` and a field `text`. */
for (const section of document.querySelectorAll("[data-filtered]")) {
  const form = section.querySelector("form");
  const rows = [...section.querySelectorAll("tbody tr")];
  const apply = () => {
    const verdict = form.elements.verdict.value;
    const text = form.elements.text.value.trim().toLowerCase();
    let shown = 0;
    for (const row of rows) {
      const fits = (!verdict || row.dataset.verdict === verdict) && row.textContent.toLowerCase().includes(text);
      row.hidden = !fits;
      shown += fits;
    }
    form.querySelector("output").textContent = `${shown} of ${rows.length} shown`;
  };
  form.addEventListener("input", apply);
  form.addEventListener("submit", (event) => event.preventDefault());
  apply();
}
