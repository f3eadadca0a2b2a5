// The filters over the table of cases.
const form = document.querySelector('.filters');
const rows = [...document.querySelectorAll('tr.case')];
function apply() {
  const words = form.elements.words.value.toLowerCase().split(/\s+/).filter(Boolean);
  let shown = 0;
  for (const row of rows) {
    const text = row.textContent.toLowerCase();
    const fits = ['verdict', 'tier', 'stage'].every(
        (key) => !form.elements[key].value || row.dataset[key] === form.elements[key].value);
    row.hidden = !fits || !words.every((word) => text.includes(word));
    if (!row.hidden) ++shown;
  }
  form.elements.count.value = `${shown} of ${rows.length} cases`;
}
form.hidden = false;
form.addEventListener('input', apply);
form.addEventListener('submit', (event) => event.preventDefault());
apply();
