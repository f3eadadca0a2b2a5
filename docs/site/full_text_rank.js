// Ranks the sections of the site for a query, by BM25F with more for words that make up a heading
// or stand together. Without the page, so that tests run it as it is.
// Sections: [file, anchor, title, heading, text, keywords, names]. Several keywords or names have
// commas between them.
const fullTextRank = (() => {
  const {kStopWords, kFaintWords, kWord, wordsOf, formsOf, spelled, stem, distance} = fullTextWords;
  const kPerPage = 3;     // sections of a page that are listed
  const kSaturation = 1;  // k1 of BM25
  // A word's weight in each field, and how much the field's length takes from that (b).
  const kFields = {
    title: {weight: 1, byLength: 0.3},
    heading: {weight: 3, byLength: 0.3},
    text: {weight: 1, byLength: 0.7},
    keywords: {weight: 4, byLength: 0},
    names: {weight: 2, byLength: 0}
  };
  const kFaint = 0.2, kPrefix = 0.4, kNear = 0.8;
  const kKeywordFit = 2, kNameFit = 1.5, kHeadingFit = 1.5, kTogether = 0.4;
  const kWhole = 1.2;     // for all words
  const kLookedAt = 100;  // sections in which words are looked for beside each other
  // Pages that few people want first: what was tried, tables of numbers, sources, tests.
  const kPages = [
    [/^(dir|experiments)_|_numbers(_\w+)?\.html$|_8h_source\.html$/, 0.3],
    [/^safety_(faults|traceability|fuzzing)\.html$|^(globals|pages|modules)/, 0.5],
    [/^(group__|struct|union)|^api_samples\.html$|^(stages|tracker|backends)_|_8h\.html$/, 0.75],
    [/^(benchmarks|architecture|release|stages|numerics)\.html$/, 0.85]
  ];
  // Pages that lack words are shown where there are fewer, or with so much of the best's points.
  const kFew = 8, kShown = 0.4;

  const weightOf = (file) => kPages.find(([pattern]) => pattern.test(file))?.[1] ?? 1;
  const isTelling = (word) => !kStopWords.has(word);
  const tellingTerms = (text) => wordsOf(text).filter(isTelling).flatMap(formsOf);
  const rarity = (all, some) => Math.log(1 + (all - some + 0.5) / (some + 0.5));
  const sum = (values) => values.reduce((a, b) => a + b, 0);

  /** What is looked up for a query: terms and where they stand. */
  function prepare(index) {
    const words = new Map();  // as they are written: how often
    const termsOf = (text) => wordsOf(text).flatMap((word) => {
      words.set(word, (words.get(word) ?? 0) + 1);
      return formsOf(word);
    });
    const listed = (text) => text.split(',').map(tellingTerms).filter(({length}) => length);
    const sections = index.map((section) => {
      const [file, anchor, title, heading, text, keywords, names] = section;
      return {
        section,
        weight: weightOf(file),
        fields: {
          title: termsOf(title),
          heading: termsOf(heading),
          text: termsOf(text),
          keywords: termsOf(keywords),
          names: [...new Set(termsOf(names))]
        },
        heading: tellingTerms(heading || (anchor ? '' : title)),
        keywords: listed(keywords),
        names: listed(names)
      };
    });
    // Headings do not say again what their page is about.
    const about = new Map();
    for (const {section: [file], fields: {title, keywords}} of sections)
      if (!about.has(file)) about.set(file, [...title, ...keywords]);
    for (const each of sections) each.about = about.get(each.section[0]);
    const counts = new Map();  // term: section: how much it counts there
    for (const [field, {weight, byLength}] of Object.entries(kFields)) {
      const mean = sum(sections.map(({fields}) => fields[field].length)) / sections.length || 1;
      sections.forEach(({fields}, at) => {
        const terms = fields[field];
        const each = weight / (1 - byLength + byLength * terms.length / mean);
        for (const term of terms) {
          if (!counts.has(term)) counts.set(term, new Map());
          const there = counts.get(term);
          there.set(at, (there.get(at) ?? 0) + each);
        }
      });
    }
    const rarities = new Map();
    for (const [term, there] of counts) rarities.set(term, rarity(sections.length, there.size));
    return {sections, counts, rarities, words};
  }

  const preparedOf = new WeakMap();
  function prepared(index) {
    if (!preparedOf.has(index)) preparedOf.set(index, prepare(index));
    return preparedOf.get(index);
  }

  // The first letter is seldom mistyped: dropped is not meant by preop.
  function nearest(words, word) {
    const limit = word.length < 4 ? 0 : word.length < 8 ? 1 : 2;
    const typed = spelled(word);
    let best = {edits: limit + 1, times: Infinity};
    for (const [other, times] of words) {
      if (Math.abs(other.length - word.length) > limit + 1 || !/^\p{L}{3,}$/u.test(other)) continue;
      if (other[0] !== word[0]) continue;
      const edits = distance(typed, spelled(other));
      if (edits < best.edits || (edits === best.edits && times > best.times))
        best = {edits, times, other};
    }
    return best.other;
  }

  /** The terms that a typed word stands for, and how well. */
  function meantBy({counts, words}, word, isLast) {
    const terms = new Map(), form = /_/.test(word) ? word : stem(word);
    if (counts.has(form)) terms.set(form, 1);
    if (isLast && word.length > 1)
      for (const term of counts.keys())
        if (term.startsWith(word) && !terms.has(term))
          terms.set(term, kPrefix * word.length / term.length);
    if (terms.size) return {terms};
    const near = nearest(words, word);
    return near ? {terms: new Map([[stem(near), kNear]]), near} : {terms};
  }

  function phrasePart({sections}, phrase) {
    const pattern =
        new RegExp(`(?<![\\p{L}\\p{N}_])${phrase.replace(/[.*+?^${}()|[\]\\]/g, '\\$&')}`, 'giu');
    const hits = new Map();
    sections.forEach(({section}, at) => {
      const count = section.slice(2).join('\n').match(pattern)?.length;
      if (count) hits.set(at, count);
    });
    return {typed: `"${phrase}"`, pattern, terms: new Map(), hits, isRequired: true};
  }

  function wordPart({sections, counts, words}, word, isLast) {
    const {terms, near} = meantBy({counts, words}, word, isLast);
    const hits = new Map();
    for (const [term, quality] of terms)
      for (const [at, count] of counts.get(term) ?? [])
        hits.set(at, (hits.get(at) ?? 0) + quality * count);
    return {typed: word, near, terms, hits, faintness: kFaintWords.has(word) ? kFaint : 1};
  }

  /** What a query asks for; without stop words, but where there is nothing else. */
  function partsOf(data, query) {
    const parts = [], plain = [];
    const kPhraseOrText = /"([^"]+)"|([^"]+)/g;
    for (const [, phrase, text] of query.matchAll(kPhraseOrText))
      if (phrase?.trim())
        parts.push(phrasePart(data, phrase.trim()));
      else
        plain.push(text ?? '');
    // "OR" is the operating room, "IT" what it is in capitals.
    const shouted = new Set(plain.join(' ').match(/\b\p{Lu}{2,}\b/gu)?.map((a) => a.toLowerCase()));
    const words = [...new Set(wordsOf(plain.join(' ')))];
    const telling = words.filter((word) => isTelling(word) || shouted.has(word));
    const taken = telling.length || parts.length ? telling : words;
    const last = wordsOf(query).at(-1);
    parts.push(...taken.map((word) => wordPart(data, word, word === last)));
    for (const part of parts)
      part.weight = (part.faintness ?? 1) * rarity(data.sections.length, part.hits.size);
    return parts;
  }

  /** How much of the terms is in the query, and of the query in them and in what is about them. */
  function fit(terms, about, {parts, meanings, all}, rarities) {
    const isMeant = (term) => meanings.has(term), meant = terms.filter(isMeant);
    if (!meant.length) return 0;
    const there = [...meant, ...about.filter(isMeant)];
    const has = (part) => Math.max(0, ...there.map((term) => part.terms.get(term) ?? 0));
    const rare = (some) => sum(some.map((term) => rarities.get(term)));
    const covered = sum(parts.map((part) => part.weight * has(part))) / all;
    return covered ** 2 * rare(meant) / rare(terms);
  }

  /** 1 where the parts stand beside each other, less where they are apart, 0 where one lacks. */
  function closeness(terms, parts) {
    if (parts.length < 2) return 0;
    const last = parts.map(() => -1);
    let shortest = Infinity;
    terms.forEach((term, at) => {
      let isPart = false;
      parts.forEach((part, i) => {
        if (!part.terms.has(term)) return;
        last[i] = at;
        isPart = true;
      });
      if (isPart && last.every((place) => place >= 0))
        shortest = Math.min(shortest, at - Math.min(...last) + 1);
    });
    return Math.min(1, parts.length / shortest);
  }

  /** All sections with anything that is asked for, with their points. */
  function scored({sections, rarities}, parts) {
    const meanings = new Set(parts.flatMap(({terms}) => [...terms.keys()]));
    const asked = {parts, meanings, all: sum(parts.map(({weight}) => weight))};
    const found = [];
    const fitOf = (several) => Math.max(0, ...several.map((one) => fit(one, [], asked, rarities)));
    sections.forEach((each, at) => {
      const had = parts.filter(({hits}) => hits.has(at));
      if (!had.length || parts.some(({isRequired, hits}) => isRequired && !hits.has(at))) return;
      const share = sum(had.map(({weight}) => weight)) / asked.all;
      const isWhole = had.length === parts.length;
      const bm25 = sum(had.map(({hits, weight}) => {
                     const count = hits.get(at);
                     return weight * count / (count + kSaturation);
                   })) /
          asked.all;
      const fits = kHeadingFit * fit(each.heading, each.about, asked, rarities) +
          kKeywordFit * fitOf(each.keywords) + kNameFit * fitOf(each.names);
      const factor = each.weight * share * (isWhole ? kWhole : 1);
      const together = factor * bm25 * kTogether * share;
      found.push({...each, had, isWhole, points: factor * (bm25 + fits), together});
    });
    const byPoints = (a, b) => b.points - a.points;
    found.sort(byPoints);
    for (const each of found.slice(0, kLookedAt))
      each.points +=
          each.together * closeness([...each.fields.heading, ...each.fields.text], each.had);
    return found.sort(byPoints);
  }

  /**
   * {pages: [[section, ...further sections of its page], ...], the best first; whole: how many of
   * them have all words; parts: what was looked for}. A part: what was typed, what was taken for it
   * where it stands nowhere (near), and the terms or the pattern to mark.
   */
  function find(index, query) {
    const data = prepared(index), parts = partsOf(data, query);
    const found = scored(data, parts), pages = new Map();
    for (const each of found) {
      const [file] = each.section;
      if (!pages.has(file)) pages.set(file, []);
      pages.get(file).push(each);
    }
    const hasWhole = (page) => page.some(({isWhole}) => isWhole);
    const shown = [...pages.values()].filter(
        (page, i) => i < kFew || page[0].points > kShown * found[0].points || hasWhole(page));
    return {
      parts,
      whole: shown.filter(hasWhole).length,
      pages: shown.map((page) => page.slice(0, kPerPage).map(({section}) => section))
    };
  }

  /** Where words or phrases that were looked for stand in a text: {from, to, part}, in order. */
  function marks(text, parts) {
    const found = [];
    for (const match of text.matchAll(kWord)) {
      const forms = formsOf(match[0].toLowerCase());
      const part = parts.find(({terms}) => forms.some((form) => terms.has(form)));
      if (part) found.push({from: match.index, to: match.index + match[0].length, part});
    }
    for (const part of parts)
      if (part.pattern)
        for (const match of text.matchAll(part.pattern))
          found.push({from: match.index, to: match.index + match[0].length, part});
    return found.sort((a, b) => a.from - b.from);
  }

  /** The ends of a part of the text, moved inwards to where words begin and end. */
  function wholeWords(text, from, to) {
    if (from > 0) from += Math.max(1, text.slice(from - 1).search(/(?<=\s)\S/)) - 1;
    const cut = to < text.length ? text.slice(0, to + 1).search(/\s\S*$/) : text.length;
    return {from: Math.max(0, from), to: cut};
  }

  /** The part of about so many characters that has most of what was looked for: {from, to}. */
  function excerpt(text, found, length) {
    let best = {worth: -1, from: 0};
    for (const {from} of found) {
      const near = found.filter((mark) => mark.from >= from && mark.to <= from + 0.7 * length);
      const worth = sum([...new Set(near.map(({part}) => part))].map(({weight}) => weight));
      if (worth > best.worth) best = {worth, from};
    }
    const from = best.from - 0.3 * length;
    return wholeWords(text, Math.round(from), Math.round(Math.max(0, from) + length));
  }

  return {find, marks, excerpt, wholeWords};
})();
