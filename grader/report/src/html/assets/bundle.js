"use strict";

/* A report in one file: shows the page that the address names, `#scenes/Spring/pair.html`, with its links to the others. */
{
  const pages = new Map([...document.querySelectorAll("template[data-page]")].map((page) => [page.dataset.page, page]));
  const asked = () => decodeURIComponent(location.hash.slice(1));
  const name = pages.has(asked()) ? asked() : "index.html";
  const { content, dataset } = pages.get(name);
  document.title = dataset.title;
  document.body.prepend(content.cloneNode(true));
  for (const link of document.querySelectorAll("a[href]")) {
    const href = link.getAttribute("href");
    const target = decodeURIComponent(new URL(href, `file:///${encodeURI(name)}`).pathname.slice(1));
    if (!href.startsWith("#") && pages.has(target)) link.setAttribute("href", `#${encodeURI(target)}`);
  }
  // Each page starts anew: its scripts know one page.
  history.scrollRestoration = "manual";
  addEventListener("hashchange", () => pages.has(asked()) && location.reload());
  // A frame may not load a page again that another page holds in memory: that page does.
  if (parent !== window) addEventListener("click", (event) => {
    const address = event.target.closest("a[href^='#']")?.getAttribute("href").slice(1);
    if (address === undefined) return;
    event.preventDefault();
    if (pages.has(decodeURIComponent(address))) parent.postMessage({ page: decodeURIComponent(address) }, "*");
    else document.getElementById(address)?.scrollIntoView();
  });
}
