"use strict";
const table = document.getElementById("clips");
const buttons = table ? [...table.querySelectorAll("thead button")] : [];
buttons.forEach((button, column) => button.addEventListener("click", () => {
  const head = button.parentElement;
  const before = head.getAttribute("aria-sort");
  const order = before === null ? button.dataset.first : before === "ascending" ? "descending" : "ascending";
  for (const other of buttons) other.parentElement.removeAttribute("aria-sort");
  head.setAttribute("aria-sort", order);
  const sign = order === "ascending" ? 1 : -1;
  const key = row => Number(row.children[column].dataset.key);
  const rows = [...table.tBodies[0].rows].sort((a, b) => sign * (key(a) - key(b)));
  table.tBodies[0].append(...rows);
}));
