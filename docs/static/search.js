// Excerpts of pages in the results of a search show an ellipsis for a formula, not its TeX.
document.addEventListener("DOMContentLoaded", () => {
  if (typeof Search === "undefined") return; // another page than that of the search
  const convertToText = Search.htmlToText;
  Search.htmlToText = (html, anchor) => {
    const page = new DOMParser().parseFromString(html, "text/html");
    page.querySelectorAll(".math").forEach((formula) => formula.replaceWith("…"));
    return convertToText(page.documentElement.outerHTML, anchor);
  };
});
