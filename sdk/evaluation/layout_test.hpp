// For tests of data sets: rendered scenes in their layouts, and what evaluating them says.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "sdk/evaluation/clip_store.hpp"
#include "sdk/evaluation/program_run.hpp"
#include "sdk/io/test_folder.hpp"
#include "sdk/scenes/writing/render_command.hpp"

namespace defrec::cli {

inline void render_layout_to(const std::filesystem::path& to, const std::string& scene,
                             const std::string& layout, int frames, int width = 320,
                             int height = 240, const std::vector<SceneSetting>& settings = {}) {
    RenderOptions options;
    options.scene = scene;
    options.settings = settings;
    options.out_dir = to.string();
    options.width = width;
    options.height = height;
    options.frames = frames;
    options.layout = layout;
    render_sequence(options, {});
}

// Evaluates a data set; returns the exit code.
inline int evaluate_set(const std::string& data_set, const std::filesystem::path& root,
                        const std::filesystem::path& out,
                        const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{"--dataset",  data_set,    root.string(), "--out",
                                       out.string(), "--backend", "cpu",         "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_evaluate_program(arguments);
}

inline nlohmann::json read_json(const std::filesystem::path& path) {
    return nlohmann::json::parse(TestFolder::read(path));
}

// A field of a row of results.csv.
inline double result_of(const std::filesystem::path& out, const std::string& clip,
                        const std::string& metric) {
    CsvReader results(out / "results.csv", {"clip", metric});
    while (results.next())
        if (results.field(0) == clip) return results.number(1);
    FAIL("no clip " << clip);
    return 0;
}

// Copies of a clip under one root, each broken in its own way, and the reasons of all.
class BrokenCopies {
  public:
    explicit BrokenCopies(std::filesystem::path original) : original_(std::move(original)) {}

    std::filesystem::path root() const { return root_.path(); }
    std::filesystem::path copy(const std::string& name) const {
        const std::filesystem::path to = root_.path() / name;
        std::filesystem::create_directories(to);
        std::filesystem::copy(original_, to, std::filesystem::copy_options::recursive);
        return to;
    }
    void evaluate(const std::string& data_set) {
        REQUIRE(evaluate_set(data_set, root_.path(), out_.path(), {"--jobs", "2"}) == 6);
        reasons_ = reasons_of(out_.path());
    }
    // Empty for a clip that was done. Commas are semicolons.
    const std::string& reason(const std::string& clip) const {
        REQUIRE(reasons_.count(clip) == 1);
        return reasons_.at(clip);
    }
    void says(const std::string& clip, const std::string& text) const {
        INFO(clip << ": " << reason(clip));
        CHECK(reason(clip).find(text) != std::string::npos);
    }

  private:
    std::filesystem::path original_;
    TestFolder root_, out_;
    std::map<std::string, std::string> reasons_;
};

}  // namespace defrec::cli
