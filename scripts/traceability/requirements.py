"""What a user may require of defrec: number, requirement, where it is defined, and the tests that
show it, by file and name."""

REQUIREMENTS = (
    (
        "Cameras",
        (
            (
                "C1",
                "images are rectified as the calibration demands",
                "stages/rectify.md",
                (
                    (
                        "sdk/rig/rig_test.cpp",
                        "the rectifying rotations are those of OpenCV's stereoRectify",
                    ),
                    (
                        "sdk/rig/rig_test.cpp",
                        (
                            "the maps are OpenCV's initUndistortRectifyMap, for every number of"
                            " coefficients"
                        ),
                    ),
                ),
            ),
            (
                "C2",
                "pixels are mapped between raw and rectified image in both directions",
                "api/coordinates.md",
                (
                    (
                        "sdk/rig/rig_test.cpp",
                        "rectified pixels are OpenCV's undistortPoints, and the way back returns",
                    ),
                ),
            ),
            (
                "C3",
                "a calibration that cannot be right is refused with the reason",
                "safety/faults.md",
                (
                    (
                        "sdk/rig/rig_test.cpp",
                        "row 1: numbers that are not finite are refused by name",
                    ),
                    (
                        "sdk/rig/rig_test.cpp",
                        "row 3: no baseline, and row 4: metres for millimetres",
                    ),
                    ("sdk/rig/rig_test.cpp", "row 5: views swapped in the calibration"),
                    (
                        "sdk/rig/rig_test.cpp",
                        "row 7: a matrix that is no rotation is refused with the residual",
                    ),
                ),
            ),
            (
                "C4",
                "views that are late or out of calibration are measured and named",
                "tracker/states.md",
                (
                    (
                        "sdk/api/rendered_test.cpp",
                        (
                            "rows 54 and 76: a right view that is late is measured, and depth from"
                            " two times is not used"
                        ),
                    ),
                    (
                        "sdk/api/rendered_test.cpp",
                        (
                            "row 106: a right view that lies askew is measured within ten frames,"
                            " and named"
                        ),
                    ),
                ),
            ),
        ),
    ),
    (
        "Tracking",
        (
            (
                "T1",
                "the deformed surface is recovered in each frame",
                "tracker/method.md",
                (
                    (
                        "sdk/tracking/tracker_test.cpp",
                        "the first frame gives the template, and a moving surface is followed",
                    ),
                    (
                        "sdk/tracking/tracker_test.cpp",
                        (
                            "row 64: a sudden shift of ten millimetres between two frames is found"
                            " in the same frame"
                        ),
                    ),
                ),
            ),
            (
                "T2",
                "a frame without enough evidence is lost, and its geometry is not given as new",
                "tracker/states.md",
                (
                    ("sdk/tracking/tracker_test.cpp", "row 58: white frames are lost and say why"),
                    (
                        "sdk/tracking/monitors/frame_state_test.cpp",
                        "row 58: without depth and without patches the frame is lost",
                    ),
                    (
                        "sdk/tracking/monitors/frame_state_test.cpp",
                        "a lost frame trusts no vertex, and less the longer it lasts",
                    ),
                ),
            ),
            (
                "T3",
                "a surface that was lost is found again, in a new epoch",
                "tracker/states.md",
                (
                    (
                        "sdk/tracking/tracker_test.cpp",
                        (
                            "rows 58 and 63: black frames are lost at once, and the surface is"
                            " found again when it returns"
                        ),
                    ),
                ),
            ),
            (
                "T4",
                "each vertex says whether it was observed",
                "api/errors.md",
                (
                    (
                        "sdk/tracking/monitors/frame_state_test.cpp",
                        (
                            "a vertex is observed where depth and image agree with the surface,"
                            " nowhere else"
                        ),
                    ),
                    (
                        "sdk/tracking/monitors/frame_state_test.cpp",
                        (
                            "row 59: half under an instrument is degraded, named occluded, and the"
                            " hidden half extrapolated"
                        ),
                    ),
                ),
            ),
            (
                "T5",
                "errors lie within the expected error as often as is said",
                "api/errors.md",
                (
                    (
                        "sdk/api/rendered_test.cpp",
                        (
                            "tissue drawn together under a tip: errors of observed points are as"
                            " expected"
                        ),
                    ),
                ),
            ),
            (
                "T6",
                "a surface at rest does not drift",
                "tracker/method.md",
                (
                    (
                        "sdk/tracking/tracker_test.cpp",
                        "row 70: a long static run with noise neither moves nor drifts",
                    ),
                ),
            ),
            (
                "T7",
                "the same input gives the same bits",
                "numerics.md",
                (
                    (
                        "sdk/tracking/tracker_test.cpp",
                        "two runs, and one or three threads, give the same bits",
                    ),
                    (
                        "sdk/tracking/overlap_test.cpp",
                        (
                            "a full queue gives the same bits as frames one by one: failures, lost"
                            " frames and new templates included"
                        ),
                    ),
                ),
            ),
            (
                "T8",
                "a template is saved, loaded and followed by another tracker",
                "tracker/method.md",
                (
                    (
                        "sdk/tracking/tracker_test.cpp",
                        "a template can be saved, loaded and tracked by another tracker",
                    ),
                ),
            ),
            (
                "T9",
                "a surface grows by tissue that comes into view, where that is asked for",
                "tracker/method.md",
                (
                    (
                        "sdk/api/growth_test.cpp",
                        (
                            "a template grows with what comes into view, and held results keep"
                            " their counts"
                        ),
                    ),
                ),
            ),
            (
                "T10",
                "points are predicted to the time of display, with an error that covers",
                "api/display.md",
                (
                    (
                        "sdk/predictor/predictor_test.cpp",
                        (
                            "noise of the tracker: half of the last frame's error at most, and"
                            " errors cover"
                        ),
                    ),
                    (
                        "sdk/predictor/predictor_test.cpp",
                        (
                            "rows 208-209: motion is forgotten over a gap, a lost frame and another"
                            " epoch"
                        ),
                    ),
                ),
            ),
            (
                "T11",
                (
                    "disparity that an application gives does what the stage's does, with its"
                    " stated error, and is compared with the images"
                ),
                "api/disparity.md",
                (
                    (
                        "sdk/api/disparity_test.cpp",
                        (
                            "disparity of stage stereo gives what the stage gives, on each kind of"
                            " device"
                        ),
                    ),
                    (
                        "sdk/api/disparity_test.cpp",
                        (
                            "errors of a true disparity with the stated noise lie within the"
                            " expected ones"
                        ),
                    ),
                    (
                        "sdk/api/disparity_test.cpp",
                        (
                            "row 201: a frame whose disparity is not of its images is degraded, its"
                            " errors grow"
                        ),
                    ),
                ),
            ),
        ),
    ),
    (
        "Behaviour in faults",
        (
            (
                "B1",
                "a wrong call changes nothing and is answered with a status",
                "api/errors.md",
                (
                    (
                        "sdk/api/handles_test.cpp",
                        (
                            "row 16: every function answers NULL, destroyed, random and foreign"
                            " handles"
                        ),
                    ),
                    (
                        "sdk/api/tracker_test.cpp",
                        (
                            "rows 16 to 24: bad frames are refused with the reason, and the queue"
                            " stays as it was"
                        ),
                    ),
                ),
            ),
            (
                "B2",
                "memory that runs out ends the call, not the application",
                "api/errors.md",
                (
                    (
                        "sdk/api/memory_test.cpp",
                        (
                            "row 50: memory runs out anywhere from context to template file, on"
                            " every backend"
                        ),
                    ),
                ),
            ),
            (
                "B3",
                "no call waits longer for a plugin than the deadline",
                "api/errors.md",
                (
                    (
                        "sdk/tracking/plugin_faults_test.cpp",
                        (
                            "rows 38 and 79: a frame whose device does not answer fails, and the"
                            " device is quarantined"
                        ),
                    ),
                    (
                        "sdk/tracking/plugin_faults_test.cpp",
                        "row 79: destroying returns although the plugin does not",
                    ),
                ),
            ),
            (
                "B4",
                "what a plugin returns is checked",
                "backends/plugins.md",
                (
                    (
                        "sdk/tracking/plugin_faults_test.cpp",
                        (
                            "rows 39 and 82: what a stage never gives fails the frame, which names"
                            " the stage"
                        ),
                    ),
                ),
            ),
            (
                "B5",
                "frames allocate nothing once there is a template",
                "api/threading.md",
                (("sdk/api/memory_test.cpp", "once there is a template, frames allocate nothing"),),
            ),
            (
                "B6",
                "calls from several threads are in order or refused",
                "api/threading.md",
                (
                    (
                        "sdk/api/tracker_test.cpp",
                        (
                            "row 28: frames submitted from several threads are queued whole, or the"
                            " call is busy"
                        ),
                    ),
                ),
            ),
            (
                "B7",
                "only plugins that others cannot change are loaded",
                "safety/security.md",
                (
                    (
                        "sdk/plugin/search_test.cpp",
                        (
                            "row 43: folders and files that anybody may write to are ignored and"
                            " logged"
                        ),
                    ),
                    ("sdk/plugin/loader_test.cpp", "row 34: one flipped bit is refused"),
                ),
            ),
            (
                "B8",
                "files that are damaged are refused",
                "safety/security.md",
                (
                    (
                        "sdk/template/file_test.cpp",
                        "numbers of a file that are not finite are refused",
                    ),
                    (
                        "sdk/template/file_test.cpp",
                        "row 94: what does not begin as a template is refused before it is read",
                    ),
                ),
            ),
            (
                "B9",
                "a frame that is short of time says what was left out, and that it is late",
                "tracker/method.md",
                (
                    (
                        "sdk/api/deadline_test.cpp",
                        (
                            "a frame that is late before it begins is followed, late and unchecked,"
                            " and says so"
                        ),
                    ),
                    (
                        "sdk/tracking/frame/quality_level_test.cpp",
                        (
                            "what does not fit is left out, in order, and frames are late only when"
                            " it is tried"
                        ),
                    ),
                ),
            ),
        ),
    ),
)
