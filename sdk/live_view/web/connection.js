// What the page asks of the program that shows it.
// A name for this page, by which the program knows whether it has heard of the end.
const page = Math.random().toString(36).slice(2);
const token = new URLSearchParams(location.search).get('token') ?? '';

const ask = (path, options = {}) =>
    fetch(path, {...options, cache: 'no-store', headers: {'X-Token': token}});

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
 * its newest frame is at most, ms; disconnected: called whenever there was no answer.
 */
export async function watchFrames({options, show, connected, disconnected}) {
  let after = -1;
  for (;;) {
    let frame = null, isAnswered = true;
    const askedAt = performance.now();
    try {
      const response =
          await ask(`/frame?after=${after}&overlay=${options().overlay ? 1 : 0}&page=${page}`);
      if (response.status === 410) return 'ended';
      if (response.status === 403) return 'refused';
      if (response.status === 200) frame = await packet(response);
      // A proxy answers in place of a program that has ended.
      isAnswered = frame || response.status === 204;
    } catch (error) {
      if (!(error instanceof TypeError)) throw error;  // fetch fails with this one
      isAnswered = false;
    }
    if (!isAnswered) {
      disconnected();
      await pause(kRetryMs);
    }
    if (!frame) continue;
    after = frame.header.frame;
    connected();
    // The answer may have waited here for longer than in the program, where the page is busy.
    const {waited_ms: waitedMs, age_ms: ageMs} = frame.header;
    await show(frame, ageMs + Math.max(0, performance.now() - askedAt - waitedMs));
  }
}

/** Once the program has closed its server, which it does when all outputs are written. */
export async function waitForOutputs() {
  for (;;) {
    try {
      // A proxy answers in place of a program that has ended.
      if ((await ask(`/frame?after=-1&overlay=0&page=${page}`)).status !== 410) return;
    } catch (error) {
      if (!(error instanceof TypeError)) throw error;
      return;
    }
    await pause(kRetryMs);
  }
}

export const fetchSurface = async () => packet(await ask('/surface'));

/** The diagnosis, as `defrec doctor --json` prints it; null while there is none. */
export async function fetchChecks() {
  const response = await ask('/checks');
  return response.status === 200 ? response.json() : null;
}

/** {isTaken, text}: the answer's, or why there is none. */
export async function post(path, value) {
  try {
    const response = await ask(path, {method: 'POST', body: JSON.stringify(value)});
    return {isTaken: response.ok, text: (await response.text()).trim()};
  } catch {
    return {isTaken: false, text: 'The program does not answer.'};
  }
}
