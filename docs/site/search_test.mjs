// Words that people type find, first or second, the page that answers. node search_test.mjs SITE
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {join} from 'node:path';

const kSite = process.argv[2];
const read = (name) => readFileSync(join(kSite, name), 'utf8');
const [index, {rank}] = new Function(`${read('full_text_index.js')}${read('full_text_rank.js')}
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
  'defrec_job_warp_points': 'group__tracking',
};
const kFirst = 2;

const wrong = [];
for (const [typed, answer] of Object.entries(kAnswers)) {
  const [page, heading] = [answer.split('/')[0], answer.split('/').slice(1).join('/')];
  const found = rank(index, typed).slice(0, kFirst);
  const isAnswered = found.some(
      ([[file, , , title]]) => file === `${page}.html` && (!heading || title === heading));
  if (!isAnswered)
    wrong.push(`${typed}: ${answer} expected, found ${
        found.map(([[file, , , title]]) => `${file}/${title}`).join(', ') || 'nothing'}`);
}
assert.deepEqual(wrong, []);
// A word that no page has finds nothing, and none no word.
assert.deepEqual(rank(index, 'qwertzuiop'), []);
assert.deepEqual(rank(index, '  '), []);
// Words in quotation marks stand in a row.
assert.ok(rank(index, '"expected error"').length > 0);
assert.ok(rank(index, '"error expected"').length < rank(index, 'error expected').length);
console.log(`${Object.keys(kAnswers).length} queries are answered`);
