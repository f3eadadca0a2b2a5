// The page of the search in all text. fullText: see full_text_rank.js.
(() => {
  const kMost = 40, kAround = 90;  // pages; characters before the word
  const query = document.getElementById('full-text-query');
  const found = document.getElementById('full-text-found');

  function snippet(text, patterns) {
    const first = patterns.map((pattern) => text.search(pattern)).find((at) => at >= 0) ?? 0;
    const {from, to} = fullTextRank.wholeWords(text, first - kAround, first + 2 * kAround);
    const part = text.slice(from, to);
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
    if (to < text.length) result.append(' …');
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

  function nearWords(words) {
    const near = fullTextRank.suggestion(fullText, words);
    if (!near) return [];
    const asked = document.createElement('p'), link = document.createElement('a');
    link.href = `#${encodeURIComponent(near)}`;
    link.textContent = near;
    link.addEventListener('click', (event) => {
      event.preventDefault();
      query.value = near;
      show();
    });
    asked.append('Did you mean ', link, '?');
    return [asked];
  }

  function show() {
    const words = query.value.trim(), patterns = fullTextRank.patternsOf(words);
    history.replaceState(null, '', words ? `#${encodeURIComponent(words)}` : '#');
    if (!patterns.length) return found.replaceChildren();
    const {pages, isWhole} = fullTextRank.find(fullText, words);
    const list = document.createElement('ol');
    list.append(...pages.slice(0, kMost).map((sections) => itemOf(sections, patterns)));
    const told = document.createElement('p');
    const number = `${pages.length} page${pages.length === 1 ? '' : 's'}`;
    told.textContent = isWhole ? number :
        pages.length           ? `No section has all these words; ${number} with most of them:` :
                                 'No page has these words.';
    found.replaceChildren(...nearWords(words), told, list);
  }

  query.addEventListener('input', show);
  // From the field on every page, or of a link to a search.
  query.value =
      new URLSearchParams(location.search).get('q') ?? decodeURIComponent(location.hash.slice(1));
  show();
})();
