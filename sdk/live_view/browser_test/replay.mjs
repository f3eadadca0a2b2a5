// The program's answers, kept and given to pages again, so that each state lasts as long as it is
// looked at.
import assert from 'node:assert/strict';
import {createServer} from 'node:http';

import {addressOf} from './common.mjs';

const kAnswerMs = 200;
const kReasons = {
  degraded: 'occluded',
  relocalised: 'contradicted',
  found: 'contradicted'
};
// Frames that repeat the one before: one of them, and once the program says that they stand still.
const kFrozen = {
  repeated: 'degraded',
  frozen: 'stalled'
};
const kChecks = {
  frames: 12,
  findings: []
};

/**
 * The program's answers in these states: {page, surface, tracking, lost}. State one-view: followed
 * by one view alone. A reader that is slow misses frames, so each state is to last some seconds.
 */
export async function answersOf(program, states = ['tracking', 'lost']) {
  const url = new URL(await addressOf(program));
  const headers = {'X-Token': url.searchParams.get('token')};
  const get = async (path) => {
    const response = await fetch(url.origin + path, {headers});
    return {status: response.status, body: Buffer.from(await response.arrayBuffer())};
  };
  const answers = {page: (await get(`/${url.search}`)).body};
  const missing = () => states.filter((state) => !answers[state]);
  for (let after = -1; missing().length;) {
    const path = `/frame?after=${after}&overlay=1`;
    const {status, body} = await get(path).catch(() => ({status: 'no answer'}));
    if (status === 204) continue;
    assert.equal(status, 200, `the run has no frame any more, and had none of ${missing()}`);
    const length = body.readUInt32LE(0);
    const header = JSON.parse(body.subarray(4, 4 + length));
    after = header.frame;
    const [, , state, reasons] = header.moments.at(-1);
    answers[reasons.includes('one-view') ? 'one-view' : state] = {
      header,
      sections: body.subarray(4 + length)
    };
    answers.surface ??= (await get('/surface')).body;
  }
  return answers;
}

/** A server that gives frames of the state that is set: of an answer, or a reason for none. */
export class Replay {
  constructor(answers) {
    this.answers = answers;
    this.state = 'tracking';
    this.of = null;            // the answer that is given in followed states; null: of tracking
    this.extrapolated = null;  // expected error of one more point, mm
    this.isBehindProxy = false;
    this.isCut = false;         // all but page and frames
    this.garbled = '';          // of the next frame's answer: "all", or "pictures"
    this.found = '';            // of degraded frames: "found" or "relocalised" a moment ago
    this.isUnobserved = false;  // neither tissue nor points
    this.fault =
        null;  // reasons and views of frames that are degraded or unusable: ["view-late", "right"]
    this.isGivenUp = false;  // the template of targets and plan
    this.neverPlaced = [];   // ids of further points, of users
    this.outageMs = 3000;    // without a frame, after which the source has stopped
    this.gapMs = 0;          // of the next frame: without a picture before it
    this.frame = 1000;
    this.missed = [];   // states of frames before the next one
    this.waiting = [];  // answers that come with release()
    this.server = createServer((request, response) => this.answer(request, response)).listen(0);
  }

  get url() {
    return `http://127.0.0.1:${this.server.address().port}/?token=0`;
  }

  /** Answers whoever asked to wait. */
  release() {
    for (const response of this.waiting.splice(0)) response.end();
  }

  /** "resumed" is Found again after an outage. */
  foundIn(state) {
    return state === 'degraded' || this.found === 'resumed' ? this.found : '';
  }

  /** Doubts of a frame that is less sure; see view_frame.hpp. */
  doubts() {
    const isLarge = this.extrapolated > 3, never = this.neverPlaced;
    if (!isLarge && !never.length) return null;
    return {
      large: isLarge ? [['#901'], [this.extrapolated], 1] : [[], [], 0],
      targets: [[], [], 0],
      lost: [[], [], 0],
      never: [never.slice(0, 3).map((id) => `#${id}`), [], never.length]
    };
  }

  takeGap() {
    const {gapMs} = this;
    this.gapMs = 0;
    return gapMs;
  }

  /** hasOverlay: else the picture with the grid has no name. */
  packet(hasOverlay) {
    const isLost = this.state === 'lost' && this.answers.lost;
    const {header, sections: bodies} =
        isLost ? this.answers.lost : this.answers[this.of ?? 'tracking'];
    const moments = [...this.missed.splice(0), this.state].map((state) => {
      const [, , , given, frameMs, observed, view] = header.moments.at(-1);
      const isFrozen = state in kFrozen;
      const [fault, faultyViews] = (['degraded', 'unusable'].includes(state) && this.fault) || [];
      const reasons = fault ?? (this.of ? given : isFrozen ? 'frozen' : kReasons[state] ?? given);
      return [
        ++this.frame, kAnswerMs * this.frame, kFrozen[state] ?? state, reasons, frameMs,
        isFrozen || this.isUnobserved ? 0 : observed, faultyViews ?? view, this.foundIn(state),
        false, '', state === 'degraded' ? this.doubts() : null, this.takeGap()
      ];
    });
    const known = [...header.points];
    if (this.extrapolated !== null)
      known.push([901, 1, true, '', 80, 60, 0, 0, 80, this.extrapolated]);
    known.push(...this.neverPlaced.map((id) => [id, 2, true, '']));
    const points = this.isUnobserved || this.state in kFrozen ?
        known.map(([id, , ...rest]) => [id, 2, ...rest]) :
        known;
    const sections = header.sections.map(
        ([name, bytes]) => [name === 'overlay' && !hasOverlay ? '' : name, bytes]);
    const frame = this.frame;
    let text = JSON.stringify({
      ...header,
      sections,
      points,
      frame,
      moments,
      age_ms: 0,
      outage_ms: this.outageMs,
      waited_ms: kAnswerMs,
      has_checks: true,
      is_given_up: this.isGivenUp,
      never_placed: this.neverPlaced
    });
    while (Buffer.byteLength(text) % 4) text += ' ';
    const length = Buffer.alloc(4);
    length.writeUInt32LE(Buffer.byteLength(text));
    return Buffer.concat([length, Buffer.from(text), bodies]);
  }

  /** The next answer is one of a proxy that asks for a password, or has pictures that are none. */
  body(request) {
    const {garbled} = this, packet = this.packet(request.url.includes('overlay=1'));
    this.garbled = '';
    if (garbled === 'all') return '<html>Log in</html>';
    return garbled ? packet.fill(0, 4 + packet.readUInt32LE(0)) : packet;
  }

  /** A point that is removed. */
  async change(request, response) {
    const chunks = [];
    for await (const chunk of request) chunks.push(chunk);
    const {id, removed} = JSON.parse(Buffer.concat(chunks));
    if (removed) this.neverPlaced = this.neverPlaced.filter((each) => each !== id);
    response.statusCode = 202;
    response.end('taken');
  }

  answer(request, response) {
    const isFrame = request.url.startsWith('/frame'), isPage = request.url.startsWith('/?');
    if (this.state === 'disconnected' || (this.isCut && !isFrame && !isPage)) {
      if (!this.isBehindProxy) return request.socket.destroy();
      response.statusCode = 502;
      return response.end('<html>Bad Gateway</html>');
    }
    if (isPage) {
      response.setHeader('Content-Type', 'text/html');
      return response.end(this.answers.page);
    }
    if (request.url === '/points') return this.change(request, response);
    if (request.url === '/wait') return this.waiting.push(response);
    if (request.url === '/surface') return response.end(this.answers.surface);
    if (request.url === '/checks') return response.end(JSON.stringify(kChecks));
    if (isFrame && this.state === 'ended') response.statusCode = 410;
    const isSilent = this.state === 'stalled' || !isFrame;
    if (isSilent) response.statusCode = 204;
    const body = response.statusCode === 200 ? this.body(request) : undefined;
    return setTimeout(() => response.end(body), kAnswerMs);
  }
}
