// The folder of an evaluation: what each clip left, which appears whole or not at all.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "sdk/evaluation/data_sets/data_set.hpp"

namespace defrec::cli {

// One clip with one set of parameters.
struct ClipName {
    std::string variant, clip;
};

struct Outcome {
    std::string failure;   // why it is in quarantine; empty: it is not
    std::string settings;  // what it was made with
    std::string inputs;    // what it was made of: digest_of_inputs()
    double seconds = 0;    // of its process
    std::int64_t frames = 0;
    FrameTimes frame_ms;
    std::string remark;
    std::string doubt;  // by which its truth is of something else; empty: none
    std::string notes;  // what else of its truth does not fit

    bool is_done() const { return failure.empty(); }
    // Whether it is in the metrics of all clips.
    bool counts() const { return is_done() && doubt.empty(); }
};

// DIR/clips/<variant>/<clip>/, the clip's name as one path component.
class ClipStore {
  public:
    explicit ClipStore(std::filesystem::path out) : out_(std::move(out)) {}

    std::filesystem::path folder(const ClipName& name) const;
    // An empty folder for a clip that is to be run. Throws CliError(kOutput).
    std::filesystem::path begin(const ClipName& name) const;
    // Names that folder as folder() does, in place of an earlier one.
    void commit(const ClipName& name, const Outcome& outcome) const;
    // Nothing where the clip has not been run to an end.
    std::optional<Outcome> outcome(const ClipName& name) const;

  private:
    std::filesystem::path partial(const ClipName& name) const;

    std::filesystem::path out_;
};

// What the clip's own process writes into the folder that begin() gave.
void write_score(const std::filesystem::path& folder, const ClipScore& score);

// In which a clip's samples and picture lie.
inline constexpr char kSamplesFile[] = "samples.csv";
inline constexpr char kPictureFile[] = "picture.jpg";

}  // namespace defrec::cli
