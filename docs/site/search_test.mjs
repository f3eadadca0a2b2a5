// Words that people type find, first or second, the page that answers. node search_test.mjs SITE
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {join} from 'node:path';

const kSite = process.argv[2];
const read = (name) => readFileSync(join(kSite, name), 'utf8');
const [index, {find, suggestion, wholeWords}] =
    new Function(`${read('full_text_index.js')}${read('full_text_rank.js')}
                  return [fullText, fullTextRank];`)();

// Typed: the page, and where it matters the heading on it.
const kAnswers = {
  'registration': 'program_register',
  'Slicer': 'program_live_link/View in 3D Slicer',
  '3D Slicer': 'program_live_link/View in 3D Slicer',
  'microscope': 'program_microscopes',
  'calibration': 'program_calibrating',
  'how to calibrate': 'program_calibrating',
  'latency': 'deployment_performance',
  'frame rate': 'deployment_performance',
  'fps': 'deployment_performance',
  'lost': 'deployment_operating_room/When it is lost',
  'ROS': 'questions/ROS',
  'rosbag': 'program_ros_bags',
  'Unity': 'questions/Unity, Unreal, HoloLens',
  'HoloLens': 'questions/Unity, Unreal, HoloLens',
  'GPU': 'deployment_performance/A GPU',
  'CUDA version': 'backends_cuda',
  'cuda': 'backends_cuda',
  'Windows': 'deployment_windows',
  'error code': 'api_errors/Statuses',
  'exit code': 'program_track/Exit codes',
  'coordinate system': 'api_coordinates',
  'mm': 'api_coordinates',
  'units': 'api_coordinates',
  'thread': 'api_threading',
  'licence': 'questions/May I use it in a product, and what does it cost?',
  'license': 'questions/May I use it in a product, and what does it cost?',
  'FDA': 'questions/Is it approved: FDA, CE, MDR, 510(k)?',
  'medical device': 'safety_soup',
  'MATLAB': 'questions/MATLAB',
  'depth map': 'questions/Depth map and point cloud',
  'point cloud': 'questions/Depth map and point cloud',
  'mesh': 'program_track/The other files',
  'PLY': 'program_track/The other files',
  'STL': 'program_register',
  'DICOM': 'questions/DICOM, CT and MRI',
  'monocular': 'questions/Does it work with one camera, monocular?',
  'memory': 'questions/How much memory does it take?',
  'docker': 'questions/Is there a Docker image?',
  'python': 'languages_python',
  'C#': 'languages_csharp',
  'tumor': 'program_plan',
  'OpenIGTLink': 'program_live_link',
  'hand-eye': 'program_handeye',
  'remote display': 'program_live_view',
  'accuracy': 'benchmarks',
  'install': 'index/Install',
  'mp4': 'program_track/What it reads',
  'RTSP': 'program_cameras',
  'macOS': 'questions/Does it run on Windows, macOS, ARM, Jetson?',
  'offline': 'questions/Does it send data anywhere?',
  'smoke': 'questions/Smoke, blood, instruments in front',
  'neural network': 'questions/Does it use a neural network, and which data was it trained with?',
  'jitter': 'questions/Jitter: do points tremble?',
  'firewall': 'questions/Which ports does a firewall have to open?',
  'kiosk': 'questions/A kiosk: the live view alone on a screen',
  'thread safety': 'api_threading',
  'segfault': 'questions/It crashed: segmentation fault, segfault',
  'opencl': 'questions/OpenCL',
  'dvrk': 'questions/Which endoscopes and robots: da Vinci, Storz, Olympus?',
  'heatmap': 'questions/Heatmap of errors, deformation or status',
  'segmentation mask': 'questions/Segmentation masks of instruments',
  'large expected error': 'questions/Why is the expected error large in the first frames?',
  'wrong truth': 'program_score/Whether it is the right truth',
  'What to do when lost?': 'deployment_operating_room/When it is lost',
  'alarm when lost': 'deployment_operating_room/The display',
  'audible': 'deployment_operating_room/The display',
  'beep': 'deployment_operating_room/The display',
  'warning sound': 'deployment_operating_room/The display',
  'big screen': 'deployment_operating_room/The display',
  'projector': 'deployment_operating_room/The display',
  'tumor depth': 'program_plan/Seeing it',
  'how deep tumour': 'program_plan/Seeing it',
  'how deep is the tumor?': 'program_plan/Seeing it',
  'how accurate': 'benchmarks',
  'remote': 'program_live_view/From another computer',
  'calibrate with a wooden checkerboard': 'program_calibrating',
  'defrec_job_warp_points': 'group__tracking',
};
const kFirst = 2;
// The first that is found, not the second.
const kFirstAlone = new Set(['What to do when lost?']);

const wrong = [];
for (const [typed, answer] of Object.entries(kAnswers)) {
  const [page, heading] = [answer.split('/')[0], answer.split('/').slice(1).join('/')];
  const found = find(index, typed).pages.slice(0, kFirstAlone.has(typed) ? 1 : kFirst);
  const isAnswered = found.some(
      ([[file, , , title]]) => file === `${page}.html` && (!heading || title === heading));
  if (!isAnswered)
    wrong.push(`${typed}: ${answer} expected, found ${
        found.map(([[file, , , title]]) => `${file}/${title}`).join(', ') || 'nothing'}`);
}
assert.deepEqual(wrong, []);
// A word that no page has finds nothing, and none no word.
assert.deepEqual(find(index, 'qwertzuiop').pages, []);
assert.deepEqual(find(index, '  ').pages, []);
// Words in quotation marks stand in a row.
assert.ok(find(index, '"expected error"').pages.length > 0);
assert.ok(
    find(index, '"error expected"').pages.length < find(index, 'error expected').pages.length);
// Sections with all words, else those with most, and none that lack more than half.
assert.ok(find(index, 'expected error').isWhole);
assert.ok(!find(index, 'expected error qwertzuiop').isWhole);
assert.deepEqual(find(index, 'error qwertzuiop asdfghjkl').pages, []);
// A near word for one that stands nowhere.
assert.equal(suggestion(index, 'trakcing'), 'tracking');
assert.equal(suggestion(index, 'calibraton depth'), 'calibration depth');
assert.equal(suggestion(index, 'calibration depth'), '');
assert.equal(suggestion(index, 'qwertzuiop'), '');
// Excerpts are of whole words and of text as it is read.
const kText = 'one two three four';
const cut = (from, to) => {
  const ends = wholeWords(kText, from, to);
  return kText.slice(ends.from, ends.to);
};
assert.equal(cut(1, 11), 'two');
assert.equal(cut(-5, 13), 'one two three');
assert.equal(cut(4, 40), 'two three four');
for (const [file, , title, heading, text] of index)
  assert.ok(!/<\/?tt>/.test(title + heading + text) && !/\*\* ?ignore/.test(text), file);
console.log(`${Object.keys(kAnswers).length} queries are answered`);
