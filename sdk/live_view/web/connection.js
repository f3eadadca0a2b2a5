// What the page asks of the program that shows it.
import {failed} from '../../report/web/health.js';

// A name for this page, by which the program knows whether it has heard of the end.
const page = Math.random().toString(36).slice(2);
const token = new URLSearchParams(location.search).get('token') ?? '';

/** Returns what read, async, makes of the answer; null where none comes, or not all of it. */
async function ask(path, read, options = {}) {
  try {
    return await read(
        await fetch(path, {...options, cache: 'no-store', headers: {'X-Token': token}}));
  } catch (error) {
    if (!(error instanceof TypeError)) throw error;  // fetch and what reads a body fail with this
    return null;
  }
}

/** As ask(), and null where the status is not 200. */
const fetchFrom = (path, read) =>
    ask(path, async (response) => (response.status === 200 ? read(response) : null));

/** The header and the sections, as view_packet.hpp lays them out. */
async function packet(response) {
  const body = await response.arrayBuffer();
  const length = new DataView(body).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(body, 4, length)));
  const sections = {};
  let at = 4 + length;
  for (const [name, bytes] of header.sections) {
    sections[name] = body.slice(at, at + bytes);
    at += Math.ceil(bytes / 4) * 4;
  }
  return {header, sections};
}

const pause = (ms) => new Promise((resolve) => {
  setTimeout(resolve, ms);
});

const kRetryMs = 500;

/**
 * Asks for one frame after the other, and goes on asking while the program does not answer. Returns
 * why it stopped: ended, refused. options(): { overlay }; show: async, of a packet and how old
 * its newest frame is at most, ms; connected: called with each answer, also one without a frame;
 * silent: called with one without a frame; disconnected: called whenever there was none, or one
 * that cannot be read or shown.
 */
export async function watchFrames({options, show, connected, silent, disconnected}) {
  let after = -1;
  for (;;) {
    const askedAt = performance.now();
    try {
      const answer = await ask(
          `/frame?after=${after}&overlay=${options().overlay ? 1 : 0}&page=${page}`,
          async (response) => ({
            status: response.status,
            frame: response.status === 200 ? await packet(response) : null
          }));
      if (answer?.status === 410) return 'ended';
      if (answer?.status === 403) return 'refused';
      // A proxy answers in place of a program that has ended.
      if (answer?.status === 200 || answer?.status === 204) {
        connected();
        const {frame} = answer;
        if (!frame) {
          silent();
          continue;
        }
        after = frame.header.frame;
        // The answer may have waited here for longer than in the program, where the page is busy.
        const {waited_ms: waitedMs, age_ms: ageMs} = frame.header;
        await show(frame, ageMs + Math.max(0, performance.now() - askedAt - waitedMs));
        continue;
      }
    } catch (error) {
      failed(error);
    }
    disconnected();
    await pause(kRetryMs);
  }
}

/** Once the program has closed its server, which it does when all outputs are written. */
export async function waitForOutputs() {
  // A proxy answers in place of a program that has ended.
  while (await ask(`/frame?after=-1&overlay=0&page=${page}`, async ({status}) => status) === 410)
    await pause(kRetryMs);
}

/** The packet of triangles; null where it did not come. */
export const fetchSurface = () => fetchFrom('/surface', packet);

/** The diagnosis, as `defrec doctor --json` prints it; null while there is none. */
export const fetchChecks = () => fetchFrom('/checks', (response) => response.json());

/** {isTaken, text}: the answer's, or why there is none. */
export async function post(path, value) {
  const answer = await ask(
      path, async (response) => ({isTaken: response.ok, text: (await response.text()).trim()}),
      {method: 'POST', body: JSON.stringify(value)});
  return answer ?? {isTaken: false, text: 'The program does not answer.'};
}
