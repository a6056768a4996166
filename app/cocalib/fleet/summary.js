const words = new Intl.Collator(undefined, { numeric: true, sensitivity: "base" });

const keyOf = (row, column) => row.cells[column].dataset.key ?? row.cells[column].textContent.trim();

const compared = (a, b, isNumber) => (isNumber ? Number(a) - Number(b) : words.compare(a, b));

function sort(table, heads, column) {
  const head = heads[column];
  const direction = head.getAttribute("aria-sort") === "ascending" ? -1 : 1;
  const isNumber = head.dataset.kind === "number";
  const body = table.tBodies[0];
  const rows = Array.from(body.rows, (row) => ({ row, key: keyOf(row, column) }));
  rows.sort((a, b) => {
    if (a.key === "" || b.key === "") return (a.key === "") - (b.key === ""); // what is not known comes last
    return direction * compared(a.key, b.key, isNumber);
  });
  body.append(...rows.map(({ row }) => row));
  for (const each of heads) each.setAttribute("aria-sort", "none");
  head.setAttribute("aria-sort", direction === 1 ? "ascending" : "descending");
}

for (const table of document.querySelectorAll("table.sortable")) {
  const heads = Array.from(table.tHead.rows[0].cells);
  heads.forEach((head, column) => {
    head.querySelector("button")?.addEventListener("click", () => sort(table, heads, column));
  });
}
