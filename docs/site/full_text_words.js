// Words in the form in which the search compares them: one spelling, no endings, one word for
// those that mean the same in this field.
const fullTextWords = (() => {
  // Words of questions, which say nothing of what is asked for.
  const kStopWords = new Set(
      ('a about after all am an and any are as at be been but by can could did do does for from ' +
       'get had has have how i if in into is it its long many may me much must my need of on or ' +
       'our shall should so some than that the their them then there these they this to want was ' +
       'way we were what when where whether which who whom whose why will with would you your')
          .split(' '));
  // These say a little, and stand in questions as well as in texts.
  const kFaintWords = new Set(
      ('allow between calculated computed difference done enough give happens help keep made ' +
       'make mean meaning means not now possible use used using user without work works')
          .split(' '));
  // Phrases for which other words stand, in lower case.
  const kPhrases = [
    [/\bair[- ]gapped\b|\b(?:without|no) (?:an? |the )?(?:internet|network)\b/g, 'offline'],
    [/\boperating (room|theatre|system)/g, 'operating$1'], [/\bdata sets?\b/g, 'dataset'],
    [/\bgraphics cards?\b/g, 'gpu'], [/\btime stamp/g, 'timestamp'], [/\bnon-/g, 'non'],
    [/\bh\.26/g, 'h26'], [/\bhandeye\b/g, 'hand eye'], [/\brealtime\b/g, 'real time'],
    [/\bthreadsafe/g, 'thread safe']
  ];
  // Singular, or without an ending.
  const kSameStems = new Map(Object.entries({
    lesion: 'tumor',
    laparoscop: 'endoscop',
    laparoscopic: 'endoscop',
    endoscopic: 'endoscop',
    scop: 'endoscop',
    below: 'beneath',
    underneath: 'beneath',
    deep: 'depth',
    lose: 'lost',
    losing: 'lost',
    register: 'registr',
    accurac: 'accur',
    safet: 'saf',
    lens: 'len',
    axe: 'axis',
    vertic: 'vertex',
    matric: 'matrix',
    preop: 'preoperativ',
    unity: 'unity'
  }));

  /** A word in lower case as Americans spell it. */
  function spelled(word) {
    return word.replace(/(?<=..[bdlmnpv])our/, 'or')
        .replace(/(?<=..)is(?=e|ing|ation)/, 'iz')
        .replace(/(?<=cent|met|theat)re(?=s?$)/, 'er')
        .replace(/^grey/, 'gray')
        .replace(/^licenc/, 'licens')
        .replace(/^artefact/, 'artifact')
        .replace(/flexion/, 'flection');
  }

  /** The form of a word that stands for all of its forms. */
  function stem(word) {
    word = spelled(word);
    if (!/^\p{L}{4,}$/u.test(word)) return word;
    const singular = word.replace(/ies$/, 'y').replace(/(?<![is]|...u)s$/, '');
    const short = singular.replace(/(?<=...)(?:ation|ating|ated|ate|ion|ing|ed|ly|e|y)$/, '')
                      .replace(/([^aeiou])\1$/, '$1');
    return kSameStems.get(singular) ?? kSameStems.get(short) ?? short;
  }

  const kWord = /[\p{L}\p{N}_]+(?:\+\+|#)?/gu;
  const withPhrases = (text) =>
      kPhrases.reduce((result, [several, one]) => result.replace(several, one), text.toLowerCase());
  const wordsOf = (text) => withPhrases(text).match(kWord) ?? [];
  const knownForms = new Map();
  /** A name of the API counts as a whole and by its parts. */
  function formsOf(word) {
    if (!knownForms.has(word))
      knownForms.set(
          word,
          /\p{L}_\p{L}/u.test(word) ? [word, ...word.split('_').filter(Boolean).map(stem)] :
                                      [stem(word)]);
    return knownForms.get(word);
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

  return {kStopWords, kFaintWords, kWord, wordsOf, formsOf, spelled, stem, distance};
})();
