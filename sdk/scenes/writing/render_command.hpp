// `defrec render` writes the reference sequences of docs/program/reference_sequences.md with exact
// truth. The interface that the program's main function uses; nothing here knows of the tracker.
#pragma once

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "sdk/io/field_order.hpp"
#include "sdk/scenes/scene_list.hpp"

namespace CLI {
class App;
}

namespace defrec::cli {

/// The sequence could not be written (disk full, folder not writable): exit code 7.
class RenderOutputError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

struct RenderOptions {
    std::string scene;
    std::vector<SceneSetting> settings{};  ///< the last of a parameter counts
    std::string out_dir{};
    int width = 960;   ///< px, 160..3840
    int height = 540;  ///< px, 120..2160
    int frames = 0;    ///< 1..100000; 0: the scene's own number
    std::uint64_t seed = 1;
    bool depth =
        false;  ///< also DIR/disparity/%06d.png: 16 bit, 256 x px, 0 unknown; rectified scenes only
    /// Interlaced: each image has the fields of two times half a frame apart, and truth.csv,
    /// targets and points_at count fields. Layout "defrec" only, without depth.
    FieldOrder fields = FieldOrder::kProgressive;
    std::vector<int> points_at{};   ///< frames whose images give points of tissue that is new there
    std::string layout = "defrec";  ///< or one of public_layouts()
    int threads = 0;  ///< 0: as many as the machine has; the written bits do not depend on it
};

/// Called on the calling thread after every frame; may be empty.
using ProgressFn = std::function<void(int frames_done, int frames_total)>;

/// Asked on the calling thread before every frame but the first; true ends the sequence there. May
/// be empty.
using StopFn = std::function<bool()>;

/// With layout "defrec" writes left/, right/, calibration.yaml, points.csv and truth.csv (and
/// disparity/) into options.out_dir, which is created where absent; frames that an earlier sequence
/// left there are removed, and truth.csv appears when the sequence is complete or was stopped. The
/// same options give the same bits. Returns the number of frames written. Throws RenderUsageError
/// before anything is written, RenderOutputError when a file cannot be written.
int render_sequence(const RenderOptions& options, const ProgressFn& progress,
                    const StopFn& stop = {});

/// Names of the scenes that it knows.
std::vector<std::string> scene_names();

/// Adds the subcommand. When the user chose it, `run` is set to the function that carries it out
/// and returns the exit code: 0 done, 2 usage, 7 cannot write, 130 stopped. `run` must outlive the
/// parsing. Returns the subcommand.
CLI::App* add_render_command(CLI::App& app, std::function<int()>& run, const StopFn& stop = {});

}  // namespace defrec::cli
