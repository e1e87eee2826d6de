// Sorts and filters the table of a batch. A click on a name of a column sorts by it, another click turns the order over.
"use strict";
const find = id => document.getElementById(id);
const table = document.querySelector("table"), rows = [...table.tBodies[0].rows];
const text = (row, column) => row.cells[column].textContent;
/** The number in a cell, without the spaces between its digits; NaN if it has none. */
const number = text => text === "" ? NaN : Number(text.replaceAll("\u00a0", ""));
let sorted = -1, sign = 1;
function sort(column) {
  sign = column === sorted ? -sign : 1;
  sorted = column;
  rows.sort((a, b) => {
    const [x, y] = [text(a, column), text(b, column)], difference = number(x) - number(y);
    // Cells without a figure come last.
    if (x === "" || y === "") return (x === "") - (y === "");
    return sign * (Number.isNaN(difference) ? x.localeCompare(y, undefined, { numeric: true }) : difference);
  });
  table.tBodies[0].append(...rows);
  heads.forEach((head, at) => head.setAttribute("aria-sort", at !== column ? "none" : sign > 0 ? "ascending" : "descending"));
}
function filter() {
  const words = find("words").value.toLowerCase(), verdict = find("verdict").value;
  for (const row of rows) row.hidden = !(row.textContent.toLowerCase().includes(words) && (!verdict || text(row, 1) === verdict));
  find("shown").textContent = `${rows.filter(row => !row.hidden).length} of ${rows.length}`;
}
const heads = [...table.tHead.rows[0].cells];
heads.forEach((head, column) => {
  head.tabIndex = 0;
  head.onclick = () => sort(column);
  head.onkeydown = event => { if (event.key === "Enter" || event.key === " ") { event.preventDefault(); sort(column); } };
});
find("controls").onsubmit = event => event.preventDefault();
find("words").oninput = find("verdict").oninput = filter;
find("controls").hidden = false;
filter();
document.body.dataset.state = "ready";
