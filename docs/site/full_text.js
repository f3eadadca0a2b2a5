// Finds words in all text of the site. fullText: [file, anchor, title, heading, text] of sections.
(() => {
  const kMost = 60, kAround = 90;
  const query = document.getElementById('full-text-query');
  const found = document.getElementById('full-text-found');
  const escaped = (text) => text.replace(/[.*+?^${}()|[\]\\]/g, '\\$&');

  /** Words begin so; those in quotation marks stand in a row. */
  const patternsOf = (text) => [...text.matchAll(/"([^"]+)"|(\S+)/g)].map(
      ([, phrase, word]) => new RegExp(`(?<![\\p{L}\\p{N}_])${escaped(phrase ?? word)}`, 'giu'));

  const count = (text, pattern) => (text.match(pattern) ?? []).length;

  /** 0 where a word is missing. */
  function score([, , title, heading, text], patterns) {
    let sum = 0;
    for (const pattern of patterns) {
      const part = 12 * count(heading, pattern) + 6 * count(title, pattern) +
          Math.min(5, count(text, pattern));
      if (part === 0) return 0;
      sum += part;
    }
    return sum;
  }

  function snippet(text, patterns) {
    const at = Math.max(0, text.search(patterns[0]));
    const from = Math.max(0, at - kAround), part = text.slice(from, at + 2 * kAround);
    const result = document.createElement('p');
    let last = 0;
    const all = new RegExp(patterns.map(({source}) => source).join('|'), 'giu');
    for (const match of part.matchAll(all)) {
      const mark = document.createElement('mark');
      mark.textContent = match[0];
      result.append(part.slice(last, match.index), mark);
      last = match.index + match[0].length;
    }
    result.append(part.slice(last));
    result.prepend(from > 0 ? '… ' : '');
    result.append(' …');
    return result;
  }

  function show() {
    const patterns = patternsOf(query.value.trim());
    history.replaceState(null, '', query.value ? `#${encodeURIComponent(query.value)}` : '#');
    if (!patterns.length) return found.replaceChildren();
    const best = fullText.map((entry) => [score(entry, patterns), entry])
                     .filter(([points]) => points > 0)
                     .sort((a, b) => b[0] - a[0]);
    const items = best.slice(0, kMost).map(([, [file, anchor, title, heading, text]]) => {
      const link = document.createElement('a');
      link.href = anchor ? `${file}#${anchor}` : file;
      link.textContent = heading && heading !== title ? `${title}: ${heading}` : title;
      const item = document.createElement('li');
      item.append(link, snippet(text, patterns));
      return item;
    });
    const list = document.createElement('ul');
    list.append(...items);
    const told = document.createElement('p');
    told.textContent = best.length ? `${best.length} places` : 'Nothing has all these words.';
    found.replaceChildren(told, list);
  }

  query.addEventListener('input', show);
  query.value = decodeURIComponent(location.hash.slice(1));
  show();
})();
