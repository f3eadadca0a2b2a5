// The page of the search in all text. fullText: see full_text_rank.js.
(() => {
  const kMost = 40, kLength = 270;  // pages; characters of an excerpt
  const query = document.getElementById('full-text-query');
  const found = document.getElementById('full-text-found');

  function element(tag, className, ...content) {
    const result = document.createElement(tag);
    if (className) result.className = className;
    result.append(...content);
    return result;
  }

  const nameOf = ([, , title, heading]) =>
      heading && heading !== title ? `${title}: ${heading}` : title;

  function excerpt(section, parts) {
    const text = section[4], marks = fullTextRank.marks(text, parts);
    // The link has these already.
    const named = new Set(fullTextRank.marks(nameOf(section), parts).map(({part}) => part));
    const wanted = marks.filter(({part}) => !named.has(part));
    const {from, to} = fullTextRank.excerpt(text, wanted, kLength);
    const result = element('p', '', from > 0 ? '… ' : '');
    let last = from;
    for (const mark of marks) {
      if (mark.from < last || mark.to > to) continue;
      result.append(
          text.slice(last, mark.from), element('mark', '', text.slice(mark.from, mark.to)));
      last = mark.to;
    }
    result.append(text.slice(last, to), to < text.length ? ' …' : '');
    return result;
  }

  function linkTo(section) {
    const [file, anchor] = section, link = element('a', '', nameOf(section));
    link.href = anchor ? `${file}#${anchor}` : file;
    return link;
  }

  function itemOf([best, ...others], parts) {
    const item = element('li', '', linkTo(best), excerpt(best, parts));
    if (!others.length) return item;
    const more = element('p', 'more', 'also: ');
    others.forEach((section, i) => more.append(i ? '; ' : '', linkTo(section)));
    item.append(more);
    return item;
  }

  const quoted = (parts) => parts.map(({typed}) => typed.replace(/^"?|"?$/g, '"')).join(', ');

  /** What was found, in words, and what was taken for words that stand nowhere. */
  function told({pages, whole, parts}) {
    const number = (count) => `${count} page${count === 1 ? '' : 's'}`;
    const lines = parts.filter(({near}) => near)
                      .map(({typed, near}) => `"${typed}" stands nowhere: looked for "${near}".`);
    const unknown = parts.filter(({hits}) => !hits.size);
    if (unknown.length) lines.push(`No page has ${quoted(unknown)}.`);
    if (whole === pages.length && whole)
      lines.push(`${number(whole)}${parts.length > 1 ? ' with all words' : ''}.`);
    else if (whole)
      lines.push(`${number(pages.length)}, ${whole} of them with all words.`);
    else if (pages.length && unknown.length < parts.length && parts.length > 1)
      lines.push('No section has all words; these have most.');
    return element('p', 'told', lines.join(' '));
  }

  function show() {
    const words = query.value.trim();
    history.replaceState(null, '', words ? `#${encodeURIComponent(words)}` : '#');
    const result = fullTextRank.find(fullText, words);
    if (!result.parts.length) return found.replaceChildren();
    const list = element('ol');
    list.append(...result.pages.slice(0, kMost).map((page) => itemOf(page, result.parts)));
    found.replaceChildren(told(result), list);
  }

  query.addEventListener('input', show);
  // From the field on every page, or of a link to a search.
  query.value =
      new URLSearchParams(location.search).get('q') ?? decodeURIComponent(location.hash.slice(1));
  show();
})();
