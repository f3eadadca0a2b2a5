// Row 115: what a run would destroy is told before anything is written.
#include "sdk/session/output_checks.hpp"

#include <doctest/doctest.h>

#include <filesystem>
#include <string>

#include "sdk/io/exit_code.hpp"
#include "sdk/io/test_folder.hpp"

using namespace defrec::cli;
namespace fs = std::filesystem;

namespace {

// A sequence as `defrec render` writes it, without its pixels.
struct Recording {
    Recording() {
        for (const char* view : {"left", "right"}) {
            fs::create_directory(folder / view);
            folder.write(std::string(view) + "/000000.png", "image");
        }
        for (const char* name : {"calibration.yaml", "points.csv", "targets.csv", "config.yaml",
                                 "organ.template", "both.mp4"})
            folder.write(name, name);
        options.source.left = folder / "left";
        options.source.right = folder / "right";
        options.calibration = folder / "calibration.yaml";
        options.points = folder / "points.csv";
        options.out = folder / "out";
    }

    // The message of the refusal, "" where there is none; nothing is written.
    std::string refusal() const {
        std::string message;
        try {
            check_outputs(options);
        } catch (const CliError& error) {
            CHECK(error.code() == ExitCode::kUsage);
            message = error.what();
        }
        CHECK(TestFolder::read(folder / "points.csv") == "points.csv");
        return message;
    }
    bool is_refused_with(const std::string& part) const {
        const std::string message = refusal();
        CAPTURE(message);
        return message.find(part) != std::string::npos;
    }

    TestFolder folder;
    TrackOptions options;
};

}  // namespace

TEST_CASE("row 115: outputs of their own are taken") {
    Recording recording;
    CHECK(recording.refusal().empty());
    recording.options.targets = recording.folder / "targets.csv";
    recording.options.config = recording.folder / "config.yaml";
    recording.options.recordings.trace = recording.folder / "trace.json";
    recording.options.surface.save = recording.folder / "new.template";
    CHECK(recording.refusal().empty());
    fs::create_directory(recording.folder / "out");
    recording.folder.write("out/points.csv", "frame,timestamp_ms,id\n");
    CHECK(recording.refusal().empty());
}

TEST_CASE("row 115: an output over an input is refused, also through links and other names") {
    const std::string overwrite = "would overwrite this input";
    for (const char* input : {"calibration.yaml", "points.csv", "targets.csv", "config.yaml",
                              "organ.template", "both.mp4"}) {
        CAPTURE(input);
        Recording recording;
        recording.options.targets = recording.folder / "targets.csv";
        recording.options.config = recording.folder / "config.yaml";
        recording.options.surface.load = recording.folder / "organ.template";
        recording.options.source.stereo = recording.folder / "both.mp4";
        const std::string path = recording.folder / input;
        recording.options.recordings.trace = path;
        CHECK(recording.is_refused_with(overwrite));
        recording.options.recordings.trace.clear();
        recording.options.surface.save = recording.folder / "left/../" + input;
        CHECK(recording.is_refused_with(overwrite));
        fs::create_hard_link(path, recording.folder / "hard");
        recording.options.surface.save = recording.folder / "hard";
        CHECK(recording.is_refused_with(overwrite));
        fs::create_symlink(path, recording.folder / "soft");
        recording.options.surface.save = recording.folder / "soft";
        CHECK(recording.is_refused_with(overwrite));
    }
    Recording pair;
    pair.options.calibration = pair.folder / "left.yaml," + (pair.folder / "calibration.yaml");
    pair.options.surface.save = pair.folder / "calibration.yaml";
    CHECK(pair.is_refused_with(overwrite));
    Recording image;
    image.options.recordings.trace = image.folder / "left/000000.png";
    CHECK(image.is_refused_with("among the images"));
}

TEST_CASE("row 115: an output over another output is refused, before either is there") {
    Recording recording;
    recording.options.recordings.trace = recording.folder / "out/points.csv";
    CHECK(recording.is_refused_with("is written to this file as well"));
    recording.options.recordings.trace = recording.folder / "out/../out/summary.json";
    CHECK(recording.is_refused_with("is written to this file as well"));
    recording.options.recordings.trace = recording.options.surface.save =
        recording.folder / "absent/file";
    CHECK(recording.is_refused_with("is written to this file as well"));
}

TEST_CASE("row 115: a trajectory that is read as points is not overwritten") {
    Recording recording;
    fs::create_directory(recording.folder / "out");
    recording.options.targets = recording.folder.write("out/trajectory.txt", "0 0 0 0 0 0 0 1\n");
    CHECK(recording.is_refused_with("would overwrite this input"));
}

TEST_CASE("row 115: the folder of the recording is no place where results would replace files") {
    Recording recording;
    recording.options.points.clear();  // so they are no input
    recording.options.out = recording.folder.path().string();
    CHECK(recording.is_refused_with("the recording's own"));
    recording.options.source.left = recording.folder / "left/%06d.png";
    recording.options.source.right = recording.folder / "right/%06d.png";
    CHECK(recording.is_refused_with("the recording's own"));
    recording.options.source = {};
    recording.options.source.stereo = recording.folder / "both.mp4";
    CHECK(recording.is_refused_with("the recording's own"));
    fs::create_directory(recording.folder / "other");
    recording.options.out = recording.folder / "other";
    CHECK(recording.refusal().empty());
    // Results of a run are its own.
    recording.options.source.stereo = recording.folder.write("other/both.mp4", "video");
    recording.folder.write("other/points.csv", "frame,timestamp_ms,id\n");
    CHECK(recording.is_refused_with("the recording's own"));
    recording.folder.write("other/summary.json", "{}");
    CHECK(recording.refusal().empty());
}

TEST_CASE("row 115: points to follow in the folder of another recording are not overwritten") {
    Recording recording;
    fs::create_directory(recording.folder / "other");
    recording.options.out = recording.folder / "other";
    recording.folder.write("other/points.csv", "id,u,v\n");
    CHECK(recording.is_refused_with("is no result of a run"));
    recording.folder.write("other/summary.json", "{}");
    CHECK(recording.is_refused_with("is no result of a run"));
    fs::remove(recording.folder / "other/points.csv");
    recording.folder.write("other/targets.csv", "id,x,y,z\n");
    CHECK(recording.refusal().empty());  // the run writes no targets
    recording.options.targets = recording.folder / "targets.csv";
    CHECK(recording.is_refused_with("is no result of a run"));
}
