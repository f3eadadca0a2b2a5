// Which changes of a clip's inputs are told.
#include "sdk/evaluation/clip_inputs.hpp"

#include <doctest/doctest.h>

#include "sdk/evaluation/data_sets/data_set.hpp"
#include "sdk/io/test_folder.hpp"

using namespace defrec::cli;
namespace fs = std::filesystem;

namespace {

void write_clip(const TestFolder& folder) {
    fs::create_directories(folder.path() / "clip/left");
    folder.write("clip/left/0.png", "0123");
    folder.write("clip/calibration.yaml", "f: 100\n");
    folder.write("shared.json", "{}");
}

std::string digest_of(const TestFolder& folder, const fs::path& out = "none") {
    return digest_of_inputs({folder.path() / "clip", folder.path() / "shared.json"}, out);
}

}  // namespace

TEST_CASE("inputs have one digest wherever they lie, and another one when they change") {
    const TestFolder first, second;
    write_clip(first);
    write_clip(second);
    const std::string digest = digest_of(first);
    CHECK(digest.size() == 16);
    CHECK(digest_of(second) == digest);

    const auto changed = [&](const auto& change) {
        const TestFolder folder;
        write_clip(folder);
        change(folder);
        return digest_of(folder) != digest;
    };
    CHECK(changed([](const TestFolder& f) { f.write("clip/calibration.yaml", "f: 101\n"); }));
    CHECK(changed([](const TestFolder& f) { f.write("shared.json", "[]"); }));
    CHECK(changed([](const TestFolder& f) { f.write("clip/left/0.png", "01234"); }));
    CHECK(changed([](const TestFolder& f) { f.write("clip/left/1.png", ""); }));
    CHECK(changed([](const TestFolder& f) { fs::remove(f.path() / "shared.json"); }));
    CHECK(changed([](const TestFolder& f) {
        fs::rename(f.path() / "clip/left/0.png", f.path() / "clip/left/1.png");
    }));
    CHECK_FALSE(changed([](const TestFolder& f) { f.write("another.yaml", "x"); }));
}

TEST_CASE("results, hidden files and links back change no digest, and folders may be links") {
    const TestFolder folder, links;
    write_clip(folder);
    const std::string digest = digest_of(folder);
    const fs::path out = folder.path() / "clip/results";
    fs::create_directories(out);
    folder.write("clip/results/summary.csv", "x");
    CHECK(digest_of(folder) != digest);
    CHECK(digest_of(folder, out) == digest);
    folder.write("clip/.hidden", "x");
    fs::create_directory_symlink("..", folder.path() / "clip/left/above");
    CHECK(digest_of(folder, out) == digest);

    fs::create_directories(links.path() / "clip");
    fs::create_directory_symlink(folder.path() / "clip/left", links.path() / "clip/left");
    fs::create_symlink(folder.path() / "clip/calibration.yaml",
                       links.path() / "clip/calibration.yaml");
    fs::create_symlink(folder.path() / "shared.json", links.path() / "shared.json");
    fs::remove(folder.path() / "clip/left/above");
    CHECK(digest_of(links) == digest);
}

TEST_CASE("what lies beside a clip is among its inputs") {
    using Paths = std::vector<fs::path>;
    CHECK(data_set_of("defrec").inputs_of("/data/a") == Paths{"/data/a"});
    CHECK(data_set_of("stir").inputs_of("/data/1/left/seq00") ==
          Paths{"/data/1/left/seq00", "/data/1/right/seq00", "/data/1/calib.json"});
    CHECK(data_set_of("d4d").inputs_of("/data/session/clips/1") ==
          Paths{"/data/session/clips/1", "/data/session/clips.json", "/data/session/camera_info",
                "/data/session/pointcloud"});
    const TestFolder folder;
    fs::create_directories(folder.path() / "keyframe/data");
    const fs::path calibration = folder.write("keyframe/endoscope_calibration.yaml", "");
    CHECK(data_set_of("scared").inputs_of(folder.path() / "keyframe/data") ==
          Paths{folder.path() / "keyframe/data", calibration});
    fs::create_directories(folder.path() / "data/validation/case/1");
    const fs::path config = folder.write("config.yaml", "");
    CHECK(data_set_of("surgt").inputs_of(folder.path() / "data/validation/case/1") ==
          Paths{folder.path() / "data/validation/case/1", config});
}
