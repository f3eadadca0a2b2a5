"""The faults that are answered: number, fault, answer, and why there is no test where there is
none.

A test bears a fault's number: its name begins with "row N:", "rows N and M:" or "rows N-M:".
"""

SECTIONS = (
    (
        "Calibration",
        (
            (1, "a number that is not finite", "refused with file, key and line"),
            (2, "a focal length of 0 or below, a centre far outside of the image", "refused"),
            (3, "no baseline, or a tiny one", "refused"),
            (
                4,
                "metres, centimetres or inches given for millimetres",
                "refused with the guess, and how to say otherwise",
            ),
            (5, "left and right exchanged in the calibration", "refused with the hint"),
            (
                6,
                "left and right images exchanged",
                "lost or without a template, with `DEFREC_REASON_VIEWS_SWAPPED`",
            ),
            (7, "a matrix that is no rotation", "refused with the residual"),
            (8, "a vertical or forward baseline", "`DEFREC_ERROR_UNSUPPORTED`"),
            (9, "distortion of a wrong length, or that folds over most of the image", "refused"),
            (
                10,
                "images of another size than the calibration's",
                (
                    "refused, never scaled; a warning where the file names no size and the centre"
                    " looks like it"
                ),
            ),
            (11, "a locale with a decimal comma", "the same result"),
            (
                12,
                "a file that is deep, huge or refers to itself",
                "refused before it costs anything",
            ),
            (13, "a key twice, or unknown", "refused; the nearest key is named"),
            (14, "an empty or binary file; a byte order mark, CR LF", "refused; no difference"),
            (15, "a matrix of a wrong size", "refused"),
        ),
    ),
    (
        "Calls",
        (
            (
                16,
                "NULL, a destroyed handle, a random one, one of another kind",
                "`DEFREC_ERROR_ARGUMENT`, `DEFREC_ERROR_HANDLE`; nothing happens",
            ),
            (
                17,
                "`struct_size` of 0, too short, too long",
                "read as far as both sides know, or `DEFREC_ERROR_VERSION`",
            ),
            (18, "a number or an enumerator out of range", "`DEFREC_ERROR_ARGUMENT`"),
            (19, "unknown flags", "`DEFREC_ERROR_ARGUMENT`"),
            (
                20,
                "a stride shorter than a row, or so long that sizes overflow",
                "`DEFREC_ERROR_ARGUMENT`",
            ),
            (21, "images of 0 x 0, 1 x 1 or below the least size", "`DEFREC_ERROR_ARGUMENT`"),
            (22, "images above the largest size", "`DEFREC_ERROR_ARGUMENT`"),
            (23, "pixels at the end of the address space", "`DEFREC_ERROR_ARGUMENT`"),
            (
                24,
                "an output that is too small",
                "refused with the size needed; bytes behind it stay",
            ),
            (
                25,
                "an exception inside the library or a plugin",
                "a status; none leaves the library",
            ),
            (26, "a callback that throws", "dropped, or the call fails"),
            (27, "a call from a callback", "`DEFREC_ERROR_STATE`; nothing happens"),
            (28, "two threads in one handle", "one after the other, or `DEFREC_ERROR_BUSY`"),
            (29, "a tracker destroyed with frames under way", "their jobs end and stay valid"),
            (30, "handles used after a fork", "`DEFREC_ERROR_STATE` in the child"),
            (
                31,
                "the application's rounding mode, signals and locale",
                "neither changed nor obeyed",
            ),
        ),
    ),
    (
        "Plugins",
        (
            (
                32,
                "a library or manifest that is cut, a FIFO, a folder, a text",
                "refused with a sentence",
            ),
            (33, "a library for another processor", "refused"),
            (34, "a flipped bit", "refused by its hash"),
            (35, "a missing or undefined symbol", "refused"),
            (36, "an older or newer ABI", "refused, or taken where only the minor version differs"),
            (
                37,
                "NULL in tables; a plugin that aborts or hangs as it starts",
                "refused; `defrec devices --verify` tries it in a process of its own",
            ),
            (38, "a device that becomes slow or hangs", "given up after the deadline"),
            (39, "NaN, bad indices and wrong sizes from a plugin", "the frame fails"),
            (40, "two plugins or devices of one name", "the same one is taken each time"),
            (41, "a library closed while its threads run", "it stays loaded"),
            (42, "a plugin path from the environment of a privileged process", "ignored"),
            (43, "a plugin that others may write to", "ignored and logged"),
        ),
    ),
    (
        "Devices",
        (
            (44, "no driver, no device", "no device is listed, and others work"),
            (
                45,
                "the device's memory runs out",
                "`DEFREC_ERROR_OUT_OF_MEMORY`, the next call works",
            ),
            (46, "a device that is lost", "`DEFREC_ERROR_DEVICE_LOST` from then on; others go on"),
            (47, "work that never ends", "given up after the deadline, the device is quarantined"),
            (
                48,
                "a driver that stops loops early or computes wrongly",
                "found by known answers at the start; refused",
            ),
            (49, "backends that disagree", "held to the reference"),
            (
                50,
                "memory runs out at any allocation",
                "`DEFREC_ERROR_OUT_OF_MEMORY`, no leak, the next call works",
            ),
        ),
    ),
    (
        "Stream",
        (
            (
                51,
                "a frame that is missing, or is there twice",
                "`DEFREC_REASON_GAP`; unpaired files are refused",
            ),
            (
                52,
                "the same frame again",
                "its timestamp is refused; with a later one `DEFREC_REASON_FROZEN`",
            ),
            (53, "a timestamp that does not grow", "refused, and changes nothing"),
            (
                54,
                "left and right taken at different times",
                (
                    "`DEFREC_REASON_VIEW_LATE` with the lag: at once where rows move, within two"
                    " seconds where tissue moves along them"
                ),
            ),
            (
                55,
                "a frozen stream, or a part of the picture that stands",
                (
                    "`DEFREC_REASON_FROZEN`; nothing observed there, or from the third repeated"
                    " frame on"
                ),
            ),
            (56, "a size or format that changes", "refused"),
            (57, "a caller that overwrites its pixels after submitting", "they were copied"),
        ),
    ),
    (
        "Scene",
        (
            (58, "black, white or saturated images", "lost, with the exposure as the reason"),
            (
                59,
                "an instrument before the surface",
                (
                    "degraded, what is hidden is extrapolated; before all of it lost, the last"
                    " surface with its age"
                ),
            ),
            (60, "smoke", "degraded while there is evidence"),
            (61, "highlights", "masked"),
            (62, "no texture", "no template and no depth is invented"),
            (63, "the camera leaves and comes back", "lost, then found again with a new epoch"),
            (64, "a sudden shift", "found in the same frame, or lost"),
            (65, "a blurred image, a wet lens", "degraded or lost, with a reason"),
            (
                66,
                "blood, tissue that is cut",
                "observed no more, a larger expected error; a reason where much is hidden",
            ),
            (
                67,
                "one dark view",
                "`DEFREC_REASON_ONE_VIEW`; the right one: followed by the left one, without depth "
                "evidence; the left one: lost",
            ),
            (68, "repetitive texture", "refused as ambiguous"),
            (69, "only the camera moves", "nothing deforms"),
            (70, "a long static run", "no drift"),
        ),
    ),
    (
        "Program",
        (
            (71, "a corrupt or short video", "frames up to there are used; exit code 3"),
            (
                72,
                "a full or unwritable disk, the limit on file sizes",
                "`DEFREC_ERROR_IO`, exit code 7; no signal, no half file; what is told is there",
            ),
            (
                73,
                "Ctrl-C, a closed pipe",
                (
                    "outputs are finished, before anything that others are connected to ends; exit"
                    " code 130. A second Ctrl-C ends the program at once, and they are lost"
                ),
            ),
            (
                74,
                "a network client that is slow, gone or sends garbage",
                "the newest frame wins; it is dropped",
            ),
            (75, "names that are not ASCII", "UTF-8 everywhere"),
        ),
    ),
    (
        "Hostile calls, plugins and files",
        (
            (
                76,
                "the right view a frame late, as in row 54, or one view that stands still",
                "degraded; depth from two times is not used once the lag is told, as in row 54",
            ),
            (
                77,
                "texture too faint for features",
                "followed by patches and depth, or lost with a reason",
            ),
            (
                78,
                "a template that the tracker cannot adopt",
                "the error again until it can, or another is asked for",
            ),
            (
                79,
                "a device that never answers",
                "quarantined after the deadline; every call returns",
            ),
            (
                80,
                "a plugin that throws something else than an exception class",
                "`DEFREC_ERROR_PLUGIN`, the host lives; one that ends its thread: row 118",
            ),
            (81, "a plugin that throws when asked for its devices", "refused alone"),
            (
                82,
                "values that a stage never gives; points where nothing is known",
                "`DEFREC_ERROR_PLUGIN` naming stage and buffer; finite, unknown",
            ),
            (
                83,
                "a plugin named as a file, or behind links, in a place that others may write to",
                "the same checks on every path, with owner and group",
            ),
            (
                84,
                "a `parallel_for` that calls bodies twice, late or not at all",
                "each body runs once, or `DEFREC_ERROR_STATE`",
            ),
            (
                85,
                "links and FIFOs in the place of outputs; two runs in one folder",
                "never written through; the second run is refused",
            ),
            (86, "a small file that decodes to an enormous image", "refused by its header"),
            (87, "a video that is a list of other files", "refused"),
            (88, "grids of millions of points", "refused with the limit"),
            (89, "`pthread_cancel` within a call", "cancelled after it"),
            (90, "`dlclose` of the library with frames under way", "it stays loaded"),
            (91, "a timestamp at the end of time", "refused; the tracker stays usable"),
            (92, "a template file with disparities of 0 or below", "refused"),
            (93, "a second template for a stage that is refused", "the first one stays"),
            (94, "a sparse file of a gigabyte as a template", "refused by its first bytes"),
            (95, "a CSV header of megabytes, states without number", "refused"),
            (96, "more threads than there can be", "exit code 2"),
            (
                97,
                "a forged reply of the process that probes a plugin; a stray `.json`",
                "refused with a sentence; not listed",
            ),
            (
                98,
                "no file descriptors left",
                "the reason says so, of plugins, outputs, images and videos (row 113)",
            ),
            (99, "a baseline of 1e150 mm, cameras 100 degrees apart", "refused"),
            (100, "escape sequences in names", "shown, not sent to the terminal"),
            (
                101,
                "an allocator that ignores alignment; a small stack",
                "counts as no memory; threads of 64 KiB may call",
            ),
            (102, "idle receivers in all places of the live link", "they make room"),
            (103, "process numbers that repeat", "handles know their process by more"),
            (
                104,
                "a plugin that is exchanged between its check and its opening",
                "the checked file is loaded",
            ),
            (
                105,
                "a distortion that folds towards the corners",
                "used up to the fold, with a warning",
            ),
            (
                106,
                "a right view that lies askew, or slips sideways",
                (
                    "`DEFREC_REASON_CALIBRATION` with the estimate; corrected where asked, but for"
                    " a slip"
                ),
            ),
            (
                107,
                "a right view that is late from the start, while tissue moves along the rows",
                (
                    "told by depth that swings with the speed, as in row 54; before that a larger"
                    " expected error"
                ),
            ),
            (
                108,
                "a right view that is turned to the side",
                (
                    "`DEFREC_REASON_CALIBRATION`, and an expected error that covers it; corrected"
                    " where asked"
                ),
            ),
            (
                109,
                "a calibration of another image size, focal lengths that differ",
                "a warning; refused where they are more than four times apart",
            ),
        ),
    ),
    (
        "Neighbours, inputs and runs",
        (
            (
                110,
                "a warning with `--quiet`",
                (
                    "stands in `summary.json` and in the report; an application sees warnings by"
                    " its log callback only"
                ),
            ),
            (
                111,
                "both views zoomed in mid stream; a picture between black bars",
                (
                    "`DEFREC_REASON_CALIBRATION` from the frame of the zoom on, with errors that"
                    " cover it; `defrec doctor` finds bars"
                ),
            ),
            (
                112,
                "a client without the token that never ends its request to the live view",
                "outputs are finished first; each request has a deadline, and sockets are shut",
            ),
            (
                113,
                "a thousand connections to the live view",
                "at most 32, fewer with few descriptors; without one the reason says so",
            ),
            (
                114,
                "clients that send slowly, or ask for thousands of ranges",
                "they make room for others and are dropped after 5 s; ranges are ignored",
            ),
            (
                115,
                "an output over an input, another output or files that no run left",
                "exit code 2 before anything is written, by device and inode",
            ),
            (116, "a terminal that is closed", "as Ctrl-C, unless the run was told to ignore it"),
            (
                117,
                "a plugin that changes rounding, or unmasks floating point exceptions",
                "set back behind each call, with a warning; the numbers are the same",
            ),
            (
                118,
                "a plugin that ends or cancels the thread that called it",
                "a device that does not answer, as in row 79; a cancellation has no effect",
            ),
            (119, "a library in the current folder", "never looked for there"),
            (
                120,
                "a run that is killed, in a folder with an earlier one's results",
                (
                    "the earlier `summary.json` goes first, the new one comes last, with the run's"
                    " name and the hash of each file"
                ),
            ),
            (121, "Ctrl-C in Python during a wait for a device that hangs", "heard at once"),
            (
                122,
                "links within a data set, and clips that name files elsewhere",
                "each real folder once; plain file names only",
            ),
            (
                123,
                "nothing tracked; a point of a frame that never comes",
                "exit code 8; a note",
            ),
            (
                124,
                "`nan` as a number, a seed of 20 digits, the greatest id taken",
                "exit code 2; a free id",
            ),
            (125, "views of different rates", "refused when they are opened"),
            (
                126,
                "half written files of a run that was killed",
                "removed by the next run in the folder; those of runs that live stay",
            ),
            (
                127,
                "a name that is a formula; a header twice; a masked array in Python",
                "marked by an apostrophe; status 400; `TypeError`",
            ),
            (
                128,
                "a timestamp far ahead, and then the true ones",
                (
                    "refused until time has caught up, or another tracker takes the template; the"
                    " message says so"
                ),
            ),
            (
                129,
                "points of a first frame that gives no template",
                "followed back from the template's frame, or lost with a reason",
            ),
        ),
    ),
    (
        "Beneath the surface",
        (
            (130, "targets that are not finite", "`DEFREC_POINT_UNKNOWN`; the others move"),
            (131, "more targets than a million", "refused with the limit"),
            (132, "a body's mesh with a hole", "refused with the edge and its place"),
            (133, "a mesh that is inside out", "refused"),
            (
                134,
                "a mesh in metres, centimetres or micrometres",
                "refused with the unit that it seems to be in",
            ),
            (135, "a mesh beside the view", "refused with the distance"),
            (136, "a mesh of more than a million triangles", "refused with the limit"),
            (137, "a target in front of the surface", "moves with the surface behind it"),
            (
                138,
                "memory that runs out while a body is made",
                "there is none, points move as before; who waits is told, and may ask again",
            ),
            (139, "a held motion or a camera's pose that is no rigid motion", "refused"),
        ),
    ),
    (
        "The start, and what images show",
        (
            (
                150,
                "first frames that are black or blurred",
                "the template is a later frame's; a recording goes back and follows all from it",
            ),
            (
                151,
                "points of a frame in which no surface is followed",
                "lost, with the reason; never looked up in another frame",
            ),
            (152, "a recording in which nothing is tracked", "exit code 8"),
            (
                153,
                "interlaced video",
                (
                    "each field is tracked at its time; images submitted whole:"
                    " `DEFREC_REASON_INTERLACED`, nothing observed"
                ),
            ),
            (
                160,
                "a mask of ignored pixels that is inverted, or hides all that could be tracked",
                (
                    "`DEFREC_ERROR_ARGUMENT` with the share that it hides, where a template would"
                    " be captured"
                ),
            ),
            (
                161,
                "a video that a codec compressed beyond use",
                "told after twelve frames, with the share of the surface that has no depth",
            ),
        ),
    ),
    (
        "Registration of a model",
        (
            (
                170,
                "pairs, surfaces and starts that are no such thing",
                "refused with file and line, or with the number of the pair or point",
            ),
            (
                171,
                "a model that is cut short, has numbers that are not finite, or is too large",
                "refused with the place; holes are told, an inside-out mesh is turned",
            ),
            (
                172,
                "pairs in a line or at one place",
                "undetermined, with the axis of the turn that they leave open",
            ),
            (
                173,
                "a pair that contradicts the others, or two that are exchanged",
                (
                    "failed, with the pair; exit code 9. Beside a surface one of five or more is"
                    " left out, with a note"
                ),
            ),
            (
                174,
                "a surface like a ball, a plane or a cylinder",
                "undetermined, with every motion that it leaves open",
            ),
            (175, "a surface that fits in several ways", "ambiguous, with the other poses"),
            (
                176,
                "a surface of something else, a start too far away",
                "failed, with the residual or the share of the points that fit",
            ),
            (
                177,
                "a model in metres or centimetres",
                "metres are told by the size, and noted; another size is refused with the remedy",
            ),
        ),
    ),
    (
        "Hand-eye calibration",
        (
            (
                180,
                "poses that are shifted alone, or hardly turned",
                "undetermined: all shifts are open",
            ),
            (
                181,
                "rotations about one axis",
                "undetermined, with the direction of the shift that they leave open",
            ),
            (182, "fewer than three poses", "undetermined, with how many there are"),
            (
                183,
                "one of both streams inverted",
                "failed, and told: the poses fit the other way round; exit code 9",
            ),
            (
                184,
                "lengths of both streams in different units, or a board of another size",
                "failed, with the factor; a few per cent are noted",
            ),
            (185, "poses that do not belong together", "failed, with the residuals"),
            (
                186,
                "poses, quaternions and times that are none or do not grow",
                "refused with file and line, or with the number of the pose",
            ),
            (187, "streams that do not overlap", "undetermined, with both spans of time"),
            (
                188,
                "a motion that does not show the offset between the clocks",
                "undetermined, unless the offset is stated",
            ),
        ),
    ),
    (
        "Registration and hand-eye calibration in an application",
        (
            (
                189,
                (
                    "arrays of a registration that are missing, numbers out of range, places"
                    " farther than 1 km, counts that are too large"
                ),
                "refused, with the field or the number of the vertex, point or pair",
            ),
            (
                190,
                (
                    "likewise of a hand-eye calibration; some of its four errors; a marker's pose"
                    " that is none"
                ),
                "refused, with the field or the number of the pose",
            ),
            (
                191,
                "a hand-eye calibration that was refused, used all the same",
                "`DEFREC_ERROR_STATE`, with the reason",
            ),
            (192, "targets of a registration that are not finite", "NaN; the others move"),
            (
                193,
                "a model that is to be deformed and is not closed, or consists of several bodies",
                "refused, with the edge or how many bodies there are",
            ),
            (
                194,
                "a surface that supports no deformation that was asked for",
                (
                    "the rigid motion, with the reason and with errors that hold what may be"
                    " hidden"
                ),
            ),
        ),
    ),
    (
        "Calibrating with a board",
        (
            (
                195,
                "no board in any frame, another board, squares counted wrongly, a mirrored board",
                "refused, with what is seen instead",
            ),
            (196, "one view mirrored, both, or views exchanged", "refused, with which it is"),
            (
                197,
                "too few poses, or boards that all face the camera",
                "refused, with what is missing",
            ),
        ),
    ),
    (
        "Bags of ROS 2",
        (
            (
                198,
                "a bag that is cut off, damaged, or claims what it cannot have",
                "the frames until there, then exit code 3 with the byte",
            ),
            (
                199,
                (
                    "a bag with one view, with several that could be it, with both in one topic and"
                    " no layout, or the other way round, that ends early in one view, or with"
                    " stamps of two clocks"
                ),
                "exit code 3, with the topics of images, or with the stamps",
            ),
        ),
    ),
    (
        "Disparity from outside, and names",
        (
            (
                200,
                "a disparity or its error that is not finite, negative or too large, another size",
                "refused, with the pixel; the tracker goes on",
            ),
            (
                201,
                "a disparity that is not that of the frame's images, with a deadline too",
                "`DEFREC_REASON_DISPARITY`: no template, or degraded with larger errors",
            ),
            (
                202,
                (
                    "files of disparity: damaged, of another size or format, two of one number, of"
                    " no frame, none"
                ),
                "exit code 3 with the file",
            ),
            (
                203,
                "two targets of a plan with one name, a name that is too long or not UTF-8",
                "refused",
            ),
        ),
    ),
    (
        "Points at the time of display",
        (
            (
                204,
                (
                    "a predictor's frame with arrays that are missing, another count, a status that"
                    " there is not, numbers that are not finite, too far or negative"
                ),
                "refused, with the field and the point's number; the predictor stays as it was",
            ),
            (205, "frames whose times do not grow", "refused, with both times"),
            (
                206,
                "a time of display before the last frame, or more than 100 ms after it",
                "refused, with the time; nothing is written",
            ),
            (207, "a time of display before there is a frame", "`DEFREC_ERROR_STATE`"),
            (
                208,
                "a frame that is lost, has no template or another epoch",
                "motion before it is forgotten; while it is the last one all points are unknown",
            ),
            (
                209,
                "frames that are missing, or a point that jumps",
                "motion before a long gap is forgotten, of a jumping point its own",
            ),
        ),
    ),
    (
        "Bags of ROS 2 in SQLite files",
        (
            (
                210,
                (
                    "a bag in SQLite that is none, of other tables, cut off, damaged, or gives more"
                    " than it has bytes for"
                ),
                "exit code 3 with SQLite's reason; of damage, after the frames until there",
            ),
        ),
    ),
    (
        "Pairs beside a surface",
        (
            (
                211,
                "pairs that contradict the surface",
                "failed, with how far they put the model apart, and the worst pair",
            ),
        ),
    ),
)

# Tests that are not C++, or why there is none.
WITHOUT_TEST = {
    44: "`plugins/vulkan/loads_lacking_*`, and `plugins/cuda` where there is no CUDA driver",
    50: "`bindings/csharp/memory`, `bindings/python/memory`",
    121: "`bindings/python/calls`",
}
