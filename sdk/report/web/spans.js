// Times without a picture: plots and the bar of states say nothing of them.

/** How the page names and colours them. */
export const noPicture = {
  word: 'No picture',
  colour: '#6b7280'
};

/** The usual time between samples, ms. */
export function usualStep(times) {
  const steps = times.slice(1).map((ms, i) => ms - times[i]).sort((a, b) => a - b);
  return steps[steps.length >> 1] ?? 0;
}

/** Whether no picture came between two times, ms; gaps: the summary's list. */
export const isGapBetween = (gaps, from, to) =>
    gaps.some((gap) => from <= gap.from_ms && gap.to_ms <= to);

/**
 * The series with a sample of nulls where no picture came: lines break there. Its frame is null as
 * well.
 */
export function withGaps(series, gaps) {
  const usual = usualStep(series.ms);
  const ms = [], sources = [];
  series.ms.forEach((time, i) => {
    const gap =
        i > 0 && gaps.find((each) => series.ms[i - 1] <= each.from_ms && each.to_ms <= time);
    if (gap) {
      ms.push(gap.from_ms + Math.min(usual, (gap.to_ms - gap.from_ms) / 2));
      sources.push(null);
    }
    ms.push(time);
    sources.push(i);
  });
  const spread = (values) => sources.map((i) => (i === null ? null : values[i]));
  return {
    ...series,
    ms,
    frames: spread(series.frames),
    lines: new Map([...series.lines].map(([name, values]) => [name, spread(values)]))
  };
}

const shortSeconds = (ms) => `${+ (ms / 1000).toFixed(ms < 10000 ? 1 : 0)}`;

/** "No picture from 79 to 99 s and from 120 to 125 s"; empty where there is no gap. */
export function gapsInWords({listed, count, total_ms: total}, most) {
  if (!count) return '';
  const said = listed.slice(0, most).map(
      (gap) => `from ${shortSeconds(gap.from_ms)} to ${shortSeconds(gap.to_ms)}\u00a0s`);
  const more = count > said.length ?
      [`${count - said.length} more time${count - said.length === 1 ? '' : 's'}`] :
      [];
  const parts = [...said, ...more];
  const text = parts.length > 1 ? `${parts.slice(0, -1).join(', ')} and ${parts.at(-1)}` : parts[0];
  return `No picture ${text}` + (count > 1 ? `, ${shortSeconds(total)}\u00a0s in all` : '');
}
