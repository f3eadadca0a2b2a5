// What the page asks of the program that shows it.
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

/**
 * Asks for one frame after the other until the run ends. options(): { overlay }; show: async, of a
 * packet.
 */
export async function watchFrames(options, show, connected) {
  let after = -1;
  let failures = 0;
  while (failures < 5) {
    try {
      const response = await ask(`/frame?after=${after}&overlay=${options().overlay ? 1 : 0}`);
      if (response.status === 410) return 'The run has ended.';
      if (response.status === 403) return await response.text();
      if (response.status === 200) {
        const frame = await packet(response);
        after = frame.header.frame;
        connected();
        await show(frame);
      }
      failures = 0;
    } catch (error) {
      if (!(error instanceof TypeError)) throw error;  // fetch fails with this one
      ++failures;
      await pause(300);
    }
  }
  return 'The program has ended.';
}

export const fetchSurface = async () => packet(await ask('/surface'));

/** The diagnosis, as `defrec doctor --json` prints it; null while there is none. */
export async function fetchChecks() {
  const response = await ask('/checks');
  return response.status === 200 ? response.json() : null;
}

/** The answer's text, or why there is none. */
export async function post(path, value) {
  try {
    const response = await ask(path, {method: 'POST', body: JSON.stringify(value)});
    return (await response.text()).trim();
  } catch {
    return 'The program does not answer.';
  }
}
