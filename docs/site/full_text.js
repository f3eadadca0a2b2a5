// The page of the search in all text. fullText: see full_text_rank.js.
(() => {
  const kMost = 40, kAround = 90;  // pages; characters before the word
  const query = document.getElementById('full-text-query');
  const found = document.getElementById('full-text-found');

  function snippet(text, patterns) {
    const first = patterns.map((pattern) => text.search(pattern)).find((at) => at >= 0) ?? 0;
    const from = Math.max(0, first - kAround), part = text.slice(from, first + 2 * kAround);
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

  function linkTo([file, anchor, title, heading]) {
    const link = document.createElement('a');
    link.href = anchor ? `${file}#${anchor}` : file;
    link.textContent = heading && heading !== title ? `${title}: ${heading}` : title;
    return link;
  }

  function itemOf([best, ...others], patterns) {
    const item = document.createElement('li');
    item.append(linkTo(best), snippet(best[4], patterns));
    if (!others.length) return item;
    const more = document.createElement('p');
    more.className = 'more';
    more.append('also: ');
    others.forEach((section, i) => more.append(i ? '; ' : '', linkTo(section)));
    item.append(more);
    return item;
  }

  function show() {
    const words = query.value.trim(), patterns = fullTextRank.patternsOf(words);
    history.replaceState(null, '', words ? `#${encodeURIComponent(words)}` : '#');
    if (!patterns.length) return found.replaceChildren();
    const pages = fullTextRank.rank(fullText, words);
    const list = document.createElement('ol');
    list.append(...pages.slice(0, kMost).map((sections) => itemOf(sections, patterns)));
    const told = document.createElement('p');
    told.textContent = pages.length ? `${pages.length} page${pages.length === 1 ? '' : 's'}` :
                                      'Nothing has all these words.';
    found.replaceChildren(told, list);
  }

  query.addEventListener('input', show);
  // From the field on every page, or of a link to a search.
  query.value =
      new URLSearchParams(location.search).get('q') ?? decodeURIComponent(location.hash.slice(1));
  show();
})();
