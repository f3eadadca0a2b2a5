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

  // Words of questions, which nearly every section has.
  const kStopWords = new Set(
      ('a an and are be can do does for how i if in is it my of on or that the there this to was ' +
       'what when where which why will with you your')
          .split(' '));
  // British and American spelling alike.
  const kSpellings = [
    [/ou?r/g, 'ou?r'], [/i[sz](?=e|ing|ation)/g, 'i[sz]'], [/gr[ae]y/g, 'gr[ae]y'],
    [/licen[cs]e/g, 'licen[cs]e'], [/(met|cent)(er|re)/g, '$1(?:er|re)']
  ];

  const kPhraseOrWord = /"([^"]+)"|([^\s"]+)/g;
  const isPart = ([, phrase, word]) => phrase || /[\p{L}\p{N}]/u.test(word);
  /** Phrases and words; without stop words, but where there is nothing else. */
  function partsOf(query) {
    const parts = [...query.matchAll(kPhraseOrWord)].filter(isPart).map(
        ([, phrase, word]) => ({phrase, word: word?.replace(/[?!.,;:]+$/, '')}));
    // "OR" is the operating room, "IT" what it is in capitals.
    const telling = parts.filter(
        ({word}) => !word || word === word.toUpperCase() || !kStopWords.has(word.toLowerCase()));
    return telling.length ? telling : parts;
  }

  function spelled(word) {
    return kSpellings.reduce(
        (pattern, [spelling, any]) => pattern.replace(spelling, any), escaped(word.toLowerCase()));
  }

  /** Words begin so; those in quotation marks stand in a row. */
  const patternsOf = (query) => partsOf(query).map(
      ({phrase, word}) =>
          new RegExp(`(?<![\\p{L}\\p{N}_])${phrase ? escaped(phrase) : spelled(word)}`, 'giu'));

  const count = (text, pattern) => (text.match(pattern) ?? []).length;
  const plain = (text) => text.toLowerCase().replace(/[^\p{L}\p{N}+#]+/gu, ' ').trim();
  const weightOf = (file) => kWeights.find(([pattern]) => pattern.test(file))?.[1] ?? 1;

  const tellingWords = (text) =>
      partsOf(text).map(({phrase, word}) => plain(phrase ?? word)).join(' ');

  /** How many of the patterns a section has, and its points for these. */
  function score([file, anchor, title, heading, text, keywords], patterns, query) {
    let sum = 0, had = 0;
    for (const pattern of patterns) {
      const part = 12 * Math.min(1, count(heading, pattern)) +
          (anchor ? 4 : 16) * Math.min(1, count(title, pattern)) +
          Math.min(4, count(text, pattern)) + 20 * Math.min(1, count(keywords, pattern));
      had += part > 0;
      sum += part;
    }
    if (had === 0) return {had, points: 0};
    // Pages that were meant by just these words.
    if (keywords.split(',').some((keyword) => tellingWords(keyword) === query)) sum += 100;
    if (plain(heading) === query) sum += 12;
    if (!anchor && plain(title) === query) sum += 20;
    return {had, points: sum * weightOf(file)};
  }

  /**
   * {pages: [[section, ...further sections of its page], ...], the best first, isWhole: whether
   * they have all words}. Where no section has all words: those with the most, half at least.
   */
  function find(index, query) {
    const patterns = patternsOf(query), words = tellingWords(query);
    const scored = index.map((section) => ({section, ...score(section, patterns, words)}));
    const most = scored.reduce((max, {had}) => Math.max(max, had), 0);
    if (most === 0 || 2 * most < patterns.length) return {pages: [], isWhole: false};
    const pages = new Map();
    for (const each of scored) {
      if (each.had < most) continue;
      const [file] = each.section;
      if (!pages.has(file)) pages.set(file, []);
      pages.get(file).push(each);
    }
    const byPoints = (a, b) => b.points - a.points;
    return {
      isWhole: most === patterns.length,
      pages: [...pages.values()]
                 .map((found) => found.sort(byPoints).slice(0, kPerPage))
                 .sort(([a], [b]) => byPoints(a, b))
                 .map((found) => found.map(({section}) => section))
    };
  }

  /** Edits between two words; neighbours that are exchanged count as one. */
  function distance(a, b) {
    let before = [], last = [...Array(b.length + 1).keys()];
    for (let i = 1; i <= a.length; ++i) {
      const row = [i];
      for (let j = 1; j <= b.length; ++j) {
        row[j] = Math.min(last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] !== b[j - 1]));
        if (i > 1 && j > 1 && a[i - 1] === b[j - 2] && a[i - 2] === b[j - 1])
          row[j] = Math.min(row[j], before[j - 2] + 1);
      }
      [before, last] = [last, row];
    }
    return last[b.length];
  }

  /** The ends of a part of the text, moved inwards to where words begin and end. */
  function wholeWords(text, from, to) {
    if (from > 0) from += Math.max(1, text.slice(from - 1).search(/(?<=\s)\S/)) - 1;
    const cut = to < text.length ? text.slice(0, to + 1).search(/\s\S*$/) : text.length;
    return {from: Math.max(0, from), to: cut};
  }

  const vocabularies = new WeakMap();  // of an index: each word and how often it stands there
  function vocabularyOf(index) {
    if (!vocabularies.has(index)) {
      const counts = new Map();
      for (const section of index)
        for (const [word] of section.slice(2).join(' ').toLowerCase().matchAll(/\p{L}{3,}/gu))
          counts.set(word, (counts.get(word) ?? 0) + 1);
      vocabularies.set(index, counts);
    }
    return vocabularies.get(index);
  }

  function nearest(index, word) {
    const limit = word.length < 4 ? 0 : word.length < 8 ? 1 : 2;
    let best = {edits: limit + 1, times: 0};
    for (const [other, times] of vocabularyOf(index)) {
      if (Math.abs(other.length - word.length) > limit) continue;
      const edits = distance(word, other);
      if (edits < best.edits || (edits === best.edits && times > best.times))
        best = {edits, times, other};
    }
    return best.other;
  }

  /** The query with near words in place of those that stand nowhere; empty where there are none. */
  function suggestion(index, query) {
    let isChanged = false;
    const words = partsOf(query).map(({phrase, word}) => {
      if (phrase) return `"${phrase}"`;
      const [pattern] = patternsOf(word);
      if (index.some((section) => section.slice(2).some((text) => count(text, pattern) > 0)))
        return word;
      const other = nearest(index, word.toLowerCase());
      isChanged ||= other !== undefined;
      return other ?? word;
    });
    return isChanged ? words.join(' ') : '';
  }

  return {patternsOf, find, suggestion, wholeWords};
})();
