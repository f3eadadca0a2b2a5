// Words and questions that people type find early the section that answers. node search_test.mjs
// SITE
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {join} from 'node:path';

const kSite = process.argv[2];
const read = (name) => readFileSync(join(kSite, name), 'utf8');
const kScripts = ['full_text_index.js', 'full_text_words.js', 'full_text_rank.js'];
const [index, {stem}, {find, marks, excerpt, wholeWords}] =
    new Function(`${kScripts.map(read).join('')}
                  return [fullText, fullTextWords, fullTextRank];`)();

const kLost = 'deployment_operating_room/When it is lost';
// Typed: the page, and where it matters the heading on it, '' for its beginning. First or second.
const kWords = {
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
  'fiducials': 'program_register',
  'landmark': 'program_register',
  'fisheye': 'questions/Fisheye lenses',
  'GIL': 'languages_python/Threads',
  'asyncio': 'languages_python/Threads',
  'pinvoke': 'languages_csharp',
  'RealSense': 'questions/Depth cameras: RealSense, ZED, Kinect, lidar',
  'kinect': 'questions/Depth cameras: RealSense, ZED, Kinect, lidar',
  'android': 'questions/Does it run on Windows, macOS, ARM, Jetson?',
  'first steps': 'index/A first program',
  'heartbeat': 'program_reference_sequences',
  'resume tracking': kLost,
};
const kDisplay = 'deployment_operating_room/The display';
const kHidden = 'questions/Smoke, blood, instruments in front';
const kHelp = 'questions/Where do I ask for help, or report a fault?';
const kCite = 'questions/How do I cite it?';
const kReasons = 'api_errors/Reasons';
const kScopes = 'questions/Which endoscopes and robots: da Vinci, Storz, Olympus?';
// The same of questions and of what is mistyped, where several may answer. Among the first three.
const kQuestions = {
  // In the operating room.
  'what should I do when tracking is lost': kLost,
  'wipe the lens': kLost,
  'the lens is dirty': [kLost, 'program_doctor/What it finds'],
  'screen turned red': kDisplay,
  'what does the amber colour mean': kDisplay,
  'no picture on the monitor': kDisplay,
  'run without internet':
      ['questions/Does it send data anywhere?', 'deployment_operating_room/Network'],
  'air-gapped': ['questions/Does it send data anywhere?', 'deployment_operating_room/Network'],
  'tumour depth below surface':
      ['program_plan/Seeing it', 'program_live_view/A plan', 'api_beneath'],
  'does the tumour overlay still fit': 'questions/Does the overlay still fit the tissue?',
  'can I trust the overlay':
      ['questions/Does the overlay still fit the tissue?', 'api_beneath/When not to trust it'],
  'set up before surgery': 'deployment_operating_room/Before the first patient',
  'how often do I have to recalibrate': 'program_calibrating/When to calibrate again',
  'is my calibration good enough': 'program_calibrating/Whether it is good',
  'left and right swapped': 'program_doctor/What it finds',
  'record the operation': 'program_record',
  'disk too slow for recording': 'program_record/When the disk is too slow',
  'frames are dropped': 'program_cameras/Frames are dropped, not queued',
  'camera unplugged': 'program_cameras/A camera that stops',
  'interlaced video': 'program_track/Interlaced video',
  'watch on a tablet in another room': 'program_live_view/For a display in another room',
  'password for the live view':
      ['program_live_view/Security', 'program_live_view/For a display in another room'],
  'encrypt patient data':
      ['questions/Does it send data anywhere?', 'deployment_operating_room/Network'],
  'what to keep after the operation': 'deployment_operating_room/Afterwards',
  'who to ask for help': kHelp,
  'report a bug': kHelp,
  'support contact': [kHelp, 'safety_soup/Versions and support'],
  'zoom of the microscope was changed': 'program_microscopes',
  'bleeding in front of the camera': kHidden,
  'instrument covers the tissue': [kHidden, 'tracker_method/Tissue that is not seen'],
  'full screen on a second monitor': kDisplay,
  'name a point': [kDisplay, 'program_live_view/'],
  // Research.
  'how to cite': kCite,
  'citation bibtex': kCite,
  'which paper is this based on': kCite,
  'which datasets were used for evaluation SCARED':
      ['program_evaluate/scared', 'program_evaluate/'],
  'evaluate on my own data set': ['program_evaluate/', 'program_evaluate/defrec'],
  'STIR challenge': ['program_evaluate/stir', 'program_evaluate/stir-2026'],
  'compare with another tracker': 'program_evaluate/Baselines',
  'what does degraded mean': [
    'tracker_states/State and reasons', 'tracker_states/The same in other words',
    'api_errors/States'
  ],
  'how is the expected error computed':
      ['tracker_states/Expected error', 'api_errors/Expected error'],
  'are results reproducible': 'numerics/Repeatability',
  'same result on CPU and GPU': 'benchmarks/The same on all backends',
  'how does the deformation model work': 'tracker_method',
  'tissue is cut': 'tracker_method/Cuts',
  'organs that slide against each other': 'tracker_method/Sides that slide',
  'render a synthetic sequence with ground truth': 'program_reference_sequences',
  'median error in mm': 'benchmarks/Accuracy',
  'camera trajectory TUM': 'program_track/The other files',
  'ORB features': 'stages_orb',
  'Levenberg-Marquardt': 'stages_lm',
  'use my own stereo network for disparity': 'api_disparity',
  'meaning of the columns in points.csv': 'program_track/What it writes',
  'jupyter notebook': 'languages_python',
  'extend the template while the camera moves': 'tracker_method/Growth',
  'camera pose from a robot': [kScopes, 'program_handeye'],
  'align CT with the endoscope': ['program_register', 'questions/DICOM, CT and MRI'],
  // Development.
  'is the tracker thread safe': 'api_threading',
  'how do I follow a point from C++': [
    'api_embedding/A frame', 'api_embedding/The template',
    'questions/C++, Rust, Java, Go and other languages'
  ],
  'find_package cmake': 'deployment_packages/A folder of its own',
  'pkg-config': ['deployment_packages/A folder of its own', 'index/A first program'],
  'licences of dependencies GPL': [
    'deployment_packages/What it consists of: the component list',
    'questions/May I use it in a product, and what does it cost?'
  ],
  'SBOM': 'deployment_packages/What it consists of: the component list',
  'ABI compatibility between versions': 'api_abi',
  'on which thread are callbacks called': 'api_threading/Callbacks',
  'who frees the result': 'api_embedding/The objects',
  'write my own backend': 'backends_plugins/Writing a plugin',
  'why was my plugin refused':
      ['api_errors/Plugins that were refused', 'backends_plugins/What is checked, in this order'],
  'images already in GPU memory': 'api_device_memory',
  'zero copy': 'api_device_memory',
  'two trackers at once': 'api_embedding/Several trackers',
  'numpy images': 'languages_python/Images',
  'GPU is lost while running': 'api_embedding/When the device is lost',
  'log messages': 'api_errors/The log',
  'compensate display latency': 'api_display',
  'fork': 'api_threading/Fork',
  'what if a frame takes too long': [
    'api_threading/Deadlines', 'tracker_method/A frame\'s deadline',
    'deployment_performance/A deadline'
  ],
  'cross compile for aarch64': 'deployment_arm64/Building on another machine',
  'build with Visual Studio': 'deployment_windows/Other compilers',
  'reproducible build':
      ['deployment_packages/The same bytes', 'deployment_provenance/Build it again'],
  'verify the signature of a package': 'deployment_packages/Is it what was released?',
  'known bugs': 'safety_soup/Known anomalies',
  'what can go wrong, failure modes': ['safety_soup/What can fail, and how', 'safety_faults'],
  'traceability of requirements': 'safety_traceability',
  'convert LPS to RAS': 'api_coordinates/LPS, RAS and other conventions',
  'pixel formats': 'api_embedding/A frame',
  'hardware requirements': ['deployment_performance', 'safety_soup/What it needs'],
  'garbage collection in C#': 'languages_csharp/A loop that does not allocate',
  'defrec_template_save': 'group__template',
  'does it run on AMD cards':
      ['backends_vulkan', 'questions/Which graphics card, and which version of CUDA?'],
  'list available devices': 'index/A first program',
  'what is a control point': 'tracker_method/The template',
  'malicious plugin': 'safety_security',
  'is there a graphical user interface': 'program_live_view',
  'nonrigid registration': 'program_register',
  'h264 quality': 'program_record/H.264, lossy',
  // Names as the program prints them.
  'dark': kReasons,
  'no-texture': kReasons,
  'frozen': kReasons,
  'few matches': kReasons,
  'few-matches': kReasons,
  'contradicted': kReasons,
  'gap': kReasons,
  'what does contradicted mean': kReasons,
  'frames.csv reasons': kReasons,
  'what do the reasons in frames.csv mean': kReasons,
  'DEFREC_REASON_DARK': kReasons,
  'black frame': kReasons,
  'what happens when an image pair is missing': kReasons,
  'what is the difference between extrapolated and tracked':
      ['api_errors/Status of a point', 'tracker_states/The same in other words'],
  'tracking lost what now': kLost,
  'registration ambiguous': 'program_register/What it writes',
  'report explained': 'program_track/The other files',
  'units of points.csv': 'program_track/What it writes',
  'python example follow points': 'languages_python/From images to tracked points',
  'tutorial': 'api_samples',
  'preop model not moving':
      ['program_register', 'api_coordinates/Registering a preoperative model'],
  'my left and right images are mixed up': 'program_doctor/What it finds',
  'use a GPU instead of CPU': 'deployment_performance/A GPU',
  'can I call it from several threads at once': 'api_threading',
  'reset the tracker after the camera was moved out of the body':
      'questions/Do I reset the tracker after the camera was moved or taken out?',
  'compare with my own ground truth': 'program_score',
  'frame numbering starts at': 'questions/At which number do frames start, 0 or 1?',
  'how to choose points to follow': 'questions/Which points can be followed?',
  'points drift off the tissue': 'questions/Does the overlay still fit the tissue?',
  'too slow on my laptop': 'deployment_performance',
  'run without a GPU': 'deployment_performance/A GPU',
  'how long does a frame take': 'deployment_performance',
  'export to csv': 'program_track/What it writes',
  'number of points limit': 'questions/Which points can be followed?',
  'video is not rectified': 'api_coordinates/Calibration',
  'undistort': 'api_coordinates/Calibration',
  'libdefrec.so.1: cannot open shared object file': 'deployment_packages/A folder of its own',
  'change the frame rate': 'program_track/What it reads',
  'change parameters of the tracker': 'program_track/What it reads',
  'minimum depth': 'program_track/What it reads',
  'image format png jpg': 'program_track/What it reads',
  'depth of each pixel': 'questions/Depth map and point cloud',
  'first frame is bad choose another frame': 'program_track/The template\'s frame',
  'save video with overlay': 'program_track/The other files',
  'password for the live view': 'program_live_view/Security',
  'covariance meaning': ['api_coordinates/Uncertainty', 'program_register/The covariance'],
  // Mistyped, and while typing.
  'calibraton': 'program_calibrating',
  'laparascope': kScopes,
  'registation of CT': ['program_register', 'questions/DICOM, CT and MRI'],
  'acuracy': 'benchmarks',
  'latancy': 'deployment_performance',
  'windws': 'deployment_windows',
  'tumuor': 'program_plan',
  'disparty map': 'questions/Depth map and point cloud',
  'thred safety': 'api_threading',
  'tracking lsot': kLost,
  'calib': 'program_calibrating',
  'hand-ey': 'program_handeye',
  'dock': 'questions/Is there a Docker image?',
};
// The first that is found.
const kFirstAlone = new Set([
  'What to do when lost?', 'what should I do when tracking is lost', 'how to cite',
  'who to ask for help', 'is the tracker thread safe', 'what does degraded mean'
]);

const wrong = [];
function check(typed, answers, first) {
  const found = find(index, typed).pages.slice(0, kFirstAlone.has(typed) ? 1 : first);
  const isAnswer = (answer) => {
    const [, page, heading] = /^([^/]*)(?:[/](.*))?$/.exec(answer);
    return found.some(
        ([[file, , , title]]) =>
            file === `${page}.html` && (heading === undefined || title === heading));
  };
  if (!answers.some(isAnswer))
    wrong.push(`${typed}: ${answers.join(' or ')} expected, found ${
        found.map(([[file, , , title]]) => `${file}/${title}`).join(', ') || 'nothing'}`);
}
for (const [typed, answer] of Object.entries(kWords)) check(typed, [answer], 2);
for (const [typed, answers] of Object.entries(kQuestions)) check(typed, [answers].flat(), 3);
assert.deepEqual(wrong, []);
// A word that no page has finds nothing, and none no word.
assert.deepEqual(find(index, 'qwertzuiop').pages, []);
assert.deepEqual(find(index, '  ').pages, []);
// Words in quotation marks stand in a row.
assert.ok(find(index, '"expected error"').pages.length > 0);
assert.ok(
    find(index, '"error expected"').pages.length < find(index, 'error expected').pages.length);
// Sections with all words are counted; those with some are found as well, by the rarer ones first.
assert.ok(find(index, 'expected error').whole > 0);
const some = find(index, 'expected error qwertzuiop');
assert.equal(some.whole, 0);
assert.ok(some.pages.length > 0);
assert.deepEqual(
    some.parts.map(({typed, hits}) => [typed, hits.size > 0]),
    [['expected', true], ['error', true], ['qwertzuiop', false]]);
// A near word is taken for one that stands nowhere.
const taken = (query) => find(index, query).parts.map(({typed, near}) => near ?? typed);
assert.deepEqual(taken('trakcing'), ['tracking']);
assert.deepEqual(taken('calibraton depth'), ['calibration', 'depth']);
assert.deepEqual(taken('qwertzuiop'), ['qwertzuiop']);
// Too far from another word, or from one that begins otherwise.
for (const word of ['trackinxyz', 'xost']) assert.deepEqual(taken(word), [word]);
// Forms of a word and spellings are the same, other words are not.
const kForms = [
  ['calibrate', 'calibrating', 'calibration', 'calibrations'], ['tumour', 'tumors', 'lesion'],
  ['visualise', 'visualization'], ['licence', 'licenses'], ['drop', 'dropped', 'drops'],
  ['latency', 'latencies'], ['lens', 'lenses'], ['laparoscope', 'endoscopes'], ['less'], ['loss'],
  ['losing', 'lost'], ['GPU', 'GPUs'], ['state'], ['stereo'], ['status']
];
const stems = kForms.map((forms) => new Set(forms.map((form) => stem(form.toLowerCase()))));
stems.forEach((forms, i) => assert.equal(forms.size, 1, kForms[i]));
assert.equal(new Set(stems.flatMap((forms) => [...forms])).size, kForms.length);
// Excerpts are of whole words and of text as it is read.
const kText = 'one two three four';
const cut = (from, to) => {
  const ends = wholeWords(kText, from, to);
  return kText.slice(ends.from, ends.to);
};
assert.equal(cut(1, 11), 'two');
assert.equal(cut(-5, 13), 'one two three');
assert.equal(cut(4, 40), 'two three four');
// The part with most of what was looked for, and where it stands there.
const kLong = `error ${'and '.repeat(200)}expected error ${'or '.repeat(200)}`;
const {parts} = find(index, 'expected errors');
const found = marks(kLong, parts), part = excerpt(kLong, found, 100);
assert.deepEqual(found.map(({from, to}) => kLong.slice(from, to)), ['error', 'expected', 'error']);
assert.ok(part.from < found[1].from && part.to > found[2].to && part.from > found[0].to);
assert.deepEqual(excerpt(kLong, [], 12), {from: 0, to: 9});
for (const [file, , title, heading, text] of index)
  assert.ok(!/<\/?tt>/.test(title + heading + text) && !/\*\* ?ignore/.test(text), file);
const count = Object.keys({...kWords, ...kQuestions}).length;
console.log(`${count} queries are answered`);
