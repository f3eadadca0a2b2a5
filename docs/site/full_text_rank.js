// Ranks the sections of the site for a query. Without the page, so that tests run it as it is.
// index: [file, anchor, title, heading, text, keywords] of sections.
const fullTextRank = (() => {
  const kPerPage = 3;  // sections of a page that are listed
  // Pages that few people want first: what was tried, tables of numbers, sources, tests.
  const kWeights = [
    [/^experiments_|_numbers(_\w+)?\.html$|_8h_source\.html$/, 0.15],
    [/^safety_(faults|traceability|fuzzing)\.html$|^(globals|pages|modules)/, 0.3],
    [/^(group__|struct|union)|^api_samples\.html$|^(stages|tracker|backends)_|_8h\.html$/, 0.6],
    [/^(benchmarks|architecture|release|stages|numerics)\.html$/, 0.7]
  ];

  const escaped = (text) => text.replace(/[.*+?^${}()|[\]\\]/g, '\\$&');

  /** Words begin so; those in quotation marks stand in a row. */
  const patternsOf = (query) => [...query.matchAll(/"([^"]+)"|(\S+)/g)].map(
      ([, phrase, word]) => new RegExp(`(?<![\\p{L}\\p{N}_])${escaped(phrase ?? word)}`, 'giu'));

  const count = (text, pattern) => (text.match(pattern) ?? []).length;
  const plain = (text) => text.toLowerCase().replace(/[^\p{L}\p{N}+#]+/gu, ' ').trim();
  const weightOf = (file) => kWeights.find(([pattern]) => pattern.test(file))?.[1] ?? 1;

  /** 0 where a word is missing. */
  function score([file, anchor, title, heading, text, keywords], patterns, query) {
    let sum = 0;
    for (const pattern of patterns) {
      const part = 12 * Math.min(1, count(heading, pattern)) +
          (anchor ? 4 : 16) * Math.min(1, count(title, pattern)) +
          Math.min(4, count(text, pattern)) + 20 * Math.min(1, count(keywords, pattern));
      if (part === 0) return 0;
      sum += part;
    }
    // Pages that were meant by just these words.
    if (keywords.split(',').some((keyword) => plain(keyword) === query)) sum += 100;
    if (plain(heading) === query) sum += 12;
    if (!anchor && plain(title) === query) sum += 20;
    return sum * weightOf(file);
  }

  /** [[section, ...further sections of its page], ...], the best first. */
  function rank(index, query) {
    const patterns = patternsOf(query), words = plain(query);
    if (!patterns.length) return [];
    const pages = new Map();
    for (const section of index) {
      const points = score(section, patterns, words);
      if (points === 0) continue;
      const [file] = section;
      if (!pages.has(file)) pages.set(file, []);
      pages.get(file).push([points, section]);
    }
    const byPoints = (a, b) => b[0] - a[0];
    return [...pages.values()]
        .map((found) => found.sort(byPoints).slice(0, kPerPage))
        .sort(([a], [b]) => byPoints(a, b))
        .map((found) => found.map(([, section]) => section));
  }

  return {patternsOf, rank};
})();
