// The options that name a recording and its calibration.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "sdk/cli/commands/command_options.hpp"
#include "sdk/input/frame_source.hpp"
#include "sdk/input/recorded_folder.hpp"

namespace defrec::cli {

// A bag, which may have the calibration as well: with it, --calibration may be left out.
inline CLI::Option* add_bag_options(CLI::App& command, BagOptions& bag) {
    auto* path = command.add_option_function<std::string>(
        "--bag",
        [&command, &bag](const std::string& source) {
            bag.path = source;
            if (auto* calibration = command.get_option_no_throw("--calibration"))
                calibration->required(false);
        },
        "Bag of ROS 2 with both views: an MCAP or SQLite file, or the folder of `ros2 bag record`");
    path->type_name("P");
    auto* left = command.add_option("--left-topic", bag.left_topic,
                                    "Topic of the left images; default: by `left` in its name");
    auto* right =
        command.add_option("--right-topic", bag.right_topic, "Topic of the right images, likewise");
    auto* stereo = command.add_option("--stereo-topic", bag.stereo_topic,
                                      "Topic whose images hold both views, with --layout; default: "
                                      "the only one with images");
    for (auto* topic : {left, right, stereo}) topic->type_name("TOPIC")->needs(path);
    stereo->excludes(left)->excludes(right);
    return path;
}

// Images that hold both views have a layout, and others none. Throws CLI::ValidationError.
inline void check_layout(const CLI::App& command, const CLI::Option& stereo,
                         const CLI::Option& layout) {
    const auto is_given = [&](const char* name) { return command.count(name) > 0; };
    if (layout.count() == 0) {
        const char* name = stereo.count() > 0           ? "--stereo"
                           : is_given("--stereo-topic") ? "--stereo-topic"
                                                        : nullptr;
        if (name != nullptr)
            throw CLI::ValidationError(name, "needs --layout side-by-side or --layout top-bottom");
        return;
    }
    if (stereo.count() == 0 && !is_given("--bag"))
        throw CLI::ValidationError("--layout",
                                   "needs --stereo, or --bag with both views in one topic");
    if (is_given("--left-topic") || is_given("--right-topic"))
        throw CLI::ValidationError(
            "--layout",
            "is of images that hold both views: name their topic with --stereo-topic; or leave it "
            "out where --left-topic and --right-topic each have one view");
}

// Which images, whole as they come.
inline void add_image_options(CLI::App& command, SourceOptions& source) {
    auto* recording = command.add_option_function<std::string>(
        "--recording",
        [&source](const std::string& folder) { open_recorded_folder(folder, source); },
        "Images and times that `defrec record` wrote into this folder");
    auto* left = command.add_option(
        "--left", source.left,
        "Left images: a video, a folder of images in name order, or a %06d pattern; or a camera: "
        "/dev/video0, rtsp://ADDRESS or gst:PIPELINE of GStreamer");
    auto* right = command.add_option("--right", source.right, "Right images, likewise");
    auto* stereo = command.add_option("--stereo", source.stereo,
                                      "One source that carries both views; with --layout");
    left->type_name("P");
    right->type_name("P");
    auto* layout = command.add_option_function<std::string>(
        "--layout",
        [&source](const std::string& name) {
            source.layout = name == "top-bottom" ? Layout::kTopBottom : Layout::kSideBySide;
        },
        "How an image of --stereo, or of one topic of --bag, holds both views: side-by-side (left "
        "on the left) or top-bottom (left on top)");
    layout->type_name("L")->check(CLI::IsMember({"side-by-side", "top-bottom"}));
    stereo->type_name("P")->excludes(left)->excludes(right);
    command.parse_complete_callback([&command, &source, left, right, stereo, layout] {
        if (left->count() > right->count())
            throw CLI::ValidationError(
                "--left", "needs --right; a video that holds both views is given as --stereo");
        if (right->count() > left->count()) throw CLI::ValidationError("--right", "needs --left");
        check_layout(command, *stereo, *layout);
        source.bag.has_stereo_images = source.bag.is_given() && layout->count() > 0;
    });
    command
        .add_option_function<std::string>(
            "--frames",
            [&source](const std::string& text) { source.range = parse_frame_range(text); },
            "Only frames A to B-1, counted from 0; of interlaced images, fields")
        ->type_name("A:B");
    auto* times =
        command.add_option("--times", source.times,
                           "CSV frame,timestamp_ms: times of the images, where they are not even");
    auto* fps = command.add_option(
        "--fps", source.fps,
        "Images per second; default: the video's or camera's own, 30 for images");
    fps->type_name("R")->check(number_in(0.001, 10000.0));
    times->type_name("F")->excludes(fps);
    recording->type_name("DIR");
    auto* bag = add_bag_options(command, source.bag);
    for (auto* with_times : {recording, bag})
        with_times->excludes(left)->excludes(right)->excludes(stereo)->excludes(times)->excludes(
            fps);
    bag->excludes(recording);
}

inline void add_source_options(CLI::App& command, SourceOptions& source) {
    add_image_options(command, source);
    source.fields = FieldOrder::kAuto;
    command
        .add_option_function<std::string>(
            "--interlaced",
            [&source](const std::string& order) {
                source.fields = order == "off"         ? FieldOrder::kProgressive
                                : order == "auto"      ? FieldOrder::kAuto
                                : order == "top-first" ? FieldOrder::kTopFirst
                                                       : FieldOrder::kBottomFirst;
            },
            "Whether each field of an image is a frame of its own: off, top-first, bottom-first; "
            "default: auto, by the first images")
        ->type_name("ORDER")
        ->check(CLI::IsMember({"auto", "off", "top-first", "bottom-first"}));
}

inline void add_reconnect_option(CLI::App& command, SourceOptions& source) {
    command
        .add_option("--reconnect", source.reconnect_seconds,
                    "How long to try to start a camera again that stopped; default: 60")
        ->type_name("SECONDS")
        ->check(number_in(0.0, 1e6));
}

inline void add_calibration_options(CLI::App& command, std::string& calibration,
                                    LengthUnit& units) {
    command
        .add_option("--calibration", calibration,
                    "OpenCV stereo YAML (M1 D1 M2 D2 R T, mm), or two ROS camera_info files "
                    "left.yaml,right.yaml; default of --bag: its own camera_info")
        ->type_name("F")
        ->required();
    add_units_option(command, units);
}

}  // namespace defrec::cli
