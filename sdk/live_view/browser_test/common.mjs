// What the tests of the live view in Chromium share.
import assert from 'node:assert/strict';
import {spawn, spawnSync} from 'node:child_process';
import {existsSync, linkSync, mkdirSync, readdirSync, rmSync} from 'node:fs';
import {createRequire} from 'node:module';
import {join, resolve} from 'node:path';
import {createInterface} from 'node:readline';

// Paths: DEFREC FOLDER_OF_NODE_MODULES SCRATCH [SCREENSHOT].
const [program, packages, scratchFolder, screenshotPath] =
    process.argv.slice(2).map((path) => resolve(path));
export const defrec = program;
export const scratch = scratchFolder, screenshot = screenshotPath;

// On a busy machine; pictures of a page take longer than looking at it. A single wait ends before
// the whole, so that its failure says which it was.
export const kPatienceMs = screenshot ? 900000 : 600000, kWaitMs = kPatienceMs / 2;

// Exit code 77: skipped.
function skip(reason) {
  console.log(`skipped: ${reason}`);
  process.exit(77);
}

/** Chromium, and an empty scratch folder. */
export async function launch() {
  const chromium = spawnSync('sh', ['-c', 'command -v chromium'], {encoding: 'utf8'}).stdout.trim();
  if (!chromium) skip('chromium is not installed');
  if (!existsSync(join(packages, 'node_modules')))
    skip('npm could not install the packages of this test');
  rmSync(scratch, {recursive: true, force: true});
  mkdirSync(scratch, {recursive: true});
  const environment = {...process.env};
  delete environment.LD_PRELOAD;  // of a sanitizer, which is not the browser's
  return createRequire(join(packages, 'package.json'))('puppeteer-core').launch({
    executablePath: chromium,
    env: environment,
    protocolTimeout: kPatienceMs,  // a wait is one call of the protocol
    args: [
      '--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
      '--disable-background-networking'
    ],
  });
}

/** Scene heartbeat as a sequence in the scratch folder. */
export function render(size, frames) {
  const rendered = spawnSync(
      defrec,
      [
        'render', 'heartbeat', '--size', size, '--frames', String(frames), '--out',
        join(scratch, 'sequence')
      ],
      {encoding: 'utf8'});
  assert.equal(rendered.status, 0, rendered.stderr);
}

/** So many frames in that sequence: its images there and back again. */
export function prolong(frames) {
  for (const view of ['left', 'right']) {
    const folder = join(scratch, 'sequence', view), images = readdirSync(folder).sort();
    const cycle = [...images, ...images.slice(1, -1).reverse()];
    for (let i = images.length; i < frames; ++i)
      linkSync(
          join(folder, cycle[i % cycle.length]), join(folder, `${String(i).padStart(6, '0')}.png`));
  }
}

/** The program, which shows views of that sequence as a recording of so many frames per second. */
export const track = (left, right, fps, ...options) => spawn(
    defrec,
    [
      'track', '--left', `sequence/${left}`, '--right', `sequence/${right}`, '--calibration',
      'sequence/calibration.yaml', '--backend', 'cpu', '--fps', String(fps), '--realtime',
      '--no-overlay', '--view', '--quiet', ...options
    ],
    {cwd: scratch, stdio: ['ignore', 'ignore', 'pipe']});

/** The address that the program prints. */
export async function addressOf(program) {
  for await (const line of createInterface(program.stderr)) {
    const url = line.match(/http:\/\/127\.0\.0\.1:\d+\/\?token=[0-9a-f]{32}/)?.[0];
    if (url) return url;
  }
  return assert.fail('the program prints the address');
}

/** A page of the browser; what goes wrong in it is added to errors. */
export async function openPage(browser, errors) {
  const page = await browser.newPage();
  page.setDefaultTimeout(kWaitMs);
  page.on('pageerror', (error) => errors.push(error.message));
  return page;
}

/** The promise, or a failure when it takes too long. */
export const inTime = (promise) => Promise.race([
  promise, new Promise((_, reject) => {
    setTimeout(() => reject(new Error('the browser did not show it in time')), kPatienceMs).unref();
  })
]);
