// See run_record.hpp.
#include "sdk/recording/run_record.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/base/os/descriptor.hpp"
#include "sdk/base/os/stdio_file.hpp"
#include "sdk/input/camera_name.hpp"
#include "sdk/input/recorded_folder.hpp"
#include "sdk/input/view_image.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/interrupt.hpp"
#include "sdk/io/json_text.hpp"
#include "sdk/io/output_folder.hpp"
#include "sdk/io/terminal.hpp"
#include "sdk/io/text.hpp"
#include "sdk/recording/frame_writer.hpp"
#include "sdk/recording/view_videos.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

void expect_source(const SourceOptions& source) {
    if (!source.has_views())
        throw CliError(ExitCode::kUsage,
                       "give the images as --left P --right P, as --stereo P --layout L, or as "
                       "--bag P.");
}

// A recording cannot be made again: nothing of another one is replaced or mixed with.
fs::path expect_empty(const fs::path& folder) {
    std::error_code error;
    if (fs::is_directory(folder, error) && !fs::is_empty(folder, error))
        throw CliError(ExitCode::kUsage, folder.string() +
                                             ": this folder is not empty; choose one for the "
                                             "recording alone with --out.");
    return folder;
}

// PNG as fast as OpenCV can.
Bytes encode(const cv::Mat& image, const std::string& extension) {
    Bytes bytes;
    if (!cv::imencode(extension, image, bytes))
        throw CliError(ExitCode::kInternal,
                       "an image of " + size_text(image.cols, image.rows) + " cannot be encoded.");
    return bytes;
}

// The pixels, for a video that takes its images one after the other.
Bytes pixels_of(const cv::Mat& image) {
    const cv::Mat whole = image.isContinuous() ? image : image.clone();
    return {whole.data, whole.data + whole.total() * whole.elemSize()};
}

// Returns when the disk has everything of the folder's file system.
void synchronise_all(const fs::path& folder) {
    const Descriptor opened(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (opened && ::syncfs(opened.get()) != 0)
        throw CliError(ExitCode::kOutput, folder.string() + ": the disk failed (" +
                                              std::generic_category().message(errno) + ").");
}

// Left image, right image, times: in this order, so that what a killed run leaves begins with
// whole pairs.
class RecordingFolder {
  public:
    // Size and type of the images, and how many come in a second.
    struct Images {
        cv::Size size;
        int type = CV_8UC3;
        double fps = 0;
    };

    // extension: of each image; empty: videos of H.264 are written.
    RecordingFolder(const fs::path& path, std::string extension, const Images& images)
        : folder_(expect_empty(path)), extension_(std::move(extension)), images_(images) {
        if (extension_.empty())
            videos_.emplace(folder_.path(), images.size, images.fps);
        else
            for (const char* view : {kLeftFolder, kRightFolder})
                create_output_folder(folder_ / view);
        times_.emplace(folder_ / kTimesFile);
        times_->write("frame,timestamp_ms\n");
    }

    void write(const EncodedPair& pair) {
        // Decimals of ms: fields are half a period later, and rounding moves none by a nanosecond.
        constexpr int kDecimals = 9;
        if (videos_) {
            videos_->write(image_of(pair.left), image_of(pair.right));
        } else {
            write_image(kLeftFolder, pair.frame, pair.left);
            write_image(kRightFolder, pair.frame, pair.right);
            bytes_ += pair.left.size() + pair.right.size();
        }
        line_.clear();
        append_integer(line_, pair.frame);
        line_ += ',';
        append_fixed(line_, pair.timestamp_ms, kDecimals);
        times_->write(line_ += '\n');
        // A run that is killed leaves them.
        times_->flush();
        last_ms_ = pair.timestamp_ms;
        ++written_;
    }

    // No more comes.
    void end_images() {
        if (!videos_) return;
        videos_->finish();
        bytes_ = videos_->bytes();
    }
    // summary: says that the recording was finished.
    void finish(const Json& summary) {
        times_->commit();
        times_.reset();
        synchronise_all(folder_.path());
        write_atomically(folder_ / kRecordingFile, json_text(summary, 2) + "\n");
        synchronise_folder(folder_.path());
    }
    // The disk may be full: what is there is kept, without the summary. Returns how many pairs
    // there are with their times, which are those that times.csv has.
    std::int64_t give_up() {
        try {
            const std::int64_t pairs = videos_ ? videos_->give_up() : written_;
            return times_ ? keep_times(pairs) : pairs;
        } catch (const std::exception&) {
            return 0;
        }
    }

    std::string run() const { return folder_.run(); }
    double last_ms() const { return last_ms_; }
    std::uint64_t bytes() const { return bytes_; }

  private:
    // Those of so many pairs. The disk may have taken a part of the last line, and what is given
    // back has room for the others.
    std::int64_t keep_times(std::int64_t pairs) {
        const std::string times = read_file(
            times_->temporary(), std::numeric_limits<std::size_t>::max(), ExitCode::kOutput);
        times_.reset();
        std::size_t end = times.find('\n') + 1;
        std::int64_t lines = 0;
        for (; lines < pairs; ++lines) {
            const std::size_t next = times.find('\n', end);
            if (next == std::string::npos) break;
            end = next + 1;
        }
        if (lines > 0)
            write_atomically(folder_ / kTimesFile, std::string_view(times).substr(0, end));
        return lines;
    }
    cv::Mat image_of(const Bytes& pixels) const {
        return {images_.size, images_.type, const_cast<unsigned char*>(pixels.data())};
    }
    void write_image(const char* view, std::int64_t frame, const Bytes& bytes) const {
        char name[32];
        std::snprintf(name, sizeof name, "%06lld", static_cast<long long>(frame));
        AtomicFile file(folder_ / view / (name + extension_));
        file.write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
        // All of them at the end: one by one they would keep the disk waiting.
        file.commit(AtomicFile::Durability::kLater);
    }

    const OutputFolder folder_;
    const std::string extension_;
    const Images images_;
    std::optional<ViewVideos> videos_;
    std::optional<AtomicFile> times_;
    std::string line_;
    double last_ms_ = 0;
    std::int64_t written_ = 0;  // pairs with their times
    std::uint64_t bytes_ = 0;
};

class Recording {
  public:
    explicit Recording(const RecordOptions& options)
        : options_(options),
          source_((expect_source(options.source), expect_empty(options.out), options.source)),
          progress_(options.quiet),
          folder_(options.out, extension(),
                  {{source_.width(), source_.height()}, CV_8UC(source_.channels()), source_.fps()}),
          writer_(
              limits(),
              [extension = extension()](const cv::Mat& image) {
                  return extension.empty() ? pixels_of(image) : encode(image, extension);
              },
              [this](const EncodedPair& pair) { folder_.write(pair); }) {
        source_.set_notice_handler([this](const std::string& notice) { say(notice); });
    }

    int run() {
        bool is_interrupted = false;
        try {
            take_all();
            is_interrupted = interrupt_requested();
            progress_.clear();
            writer_.finish();
            folder_.end_images();
            const Json summary = summarise(is_interrupted);
            folder_.finish(summary);
            report(summary);
        } catch (const FileError& error) {
            throw CliError(ExitCode::kOutput,
                           std::string(error.what()) + "; " + what_is_left(give_up()));
        } catch (const CliError& error) {
            throw CliError(error.code(), std::string(error.what()) + " " + what_is_left(give_up()));
        } catch (const std::exception&) {
            give_up();
            throw;
        }
        if (is_interrupted) return static_cast<int>(ExitCode::kInterrupted);
        return static_cast<int>(source_.fault().empty() ? ExitCode::kOk : ExitCode::kInput);
    }

  private:
    bool is_video() const { return options_.format == RecordFormat::kH264; }
    // An image's; empty for videos.
    std::string extension() const {
        if (is_video()) return "";
        return options_.format == RecordFormat::kPng ? ".png"
               : source_.channels() == 1             ? ".pgm"
                                                     : ".ppm";
    }

    FrameWriter::Limits limits() const {
        constexpr std::size_t kMegabyte = 1'000'000, kLeast = 4;
        const std::size_t pair = 2 * static_cast<std::size_t>(source_.width()) *
                                 static_cast<std::size_t>(source_.height()) *
                                 static_cast<std::size_t>(source_.channels());
        const unsigned cores = std::max(1U, std::thread::hardware_concurrency());
        return {options_.threads > 0 ? options_.threads : cores,
                std::max(kLeast, options_.queue_mb * kMegabyte / pair)};
    }

    void take_all() {
        StereoFrame frame;
        while (!interrupt_requested() && !writer_.has_failed() && source_.next(frame)) take(frame);
    }

    // Keeps what was taken before the failure; returns how many pairs are kept.
    std::int64_t give_up() {
        progress_.clear();
        try {
            writer_.finish();
        } catch (const std::exception&) {
            // It is the failure, or one more.
        }
        return folder_.give_up();
    }

    void take(const StereoFrame& frame) {
        RecordedPair pair{mat_of(frame.left), mat_of(frame.right), frame.pixels,
                          frame.timestamp_ms};
        if (source_.is_live()) {
            // Cameras have few buffers.
            pair = {pair.left.clone(), pair.right.clone(), nullptr, frame.timestamp_ms};
            if (!writer_.offer(std::move(pair)) && !writer_.has_failed()) tell_drop();
        } else {
            writer_.push(std::move(pair));
        }
        progress_.update(writer_.written(), source_.expected(), "recorded");
    }

    // The first one, the second, the fourth and so on.
    void tell_drop() {
        const std::int64_t dropped = writer_.dropped();
        if ((dropped & (dropped - 1)) != 0) return;
        progress_.clear();
        print_notice("the disk or the processor is too slow: " + std::to_string(dropped) +
                     (dropped == 1 ? " frame was" : " frames were") + " dropped until now.");
    }

    void say(const std::string& notice) {
        if (options_.quiet) return;
        progress_.clear();
        print_notice(notice);
    }

    static std::string what_is_left(std::int64_t frames) {
        return std::to_string(frames) + " frames and their times were written until then.";
    }

    Json cameras_json() const {
        const std::optional<CameraCounts> cameras = source_.camera_counts();
        if (!cameras) return nullptr;
        return {{"frames_received", cameras->pairs.pairs},
                {"frames_missed", cameras->pairs.dropped},
                {"images_unpaired", cameras->pairs.unpaired},
                {"reconnections", cameras->reconnections},
                {"longest_gap_ms", cameras->longest_gap_ms}};
    }

    Json summarise(bool is_interrupted) const {
        return {{"frames", static_cast<std::uint64_t>(writer_.written())},
                {"fps", source_.fps()},
                {"last_timestamp_ms", folder_.last_ms()},
                {"width", source_.width()},
                {"height", source_.height()},
                {"channels", source_.channels()},
                {"format", is_video() ? kVideoFormat : extension().substr(1)},
                {"lossless", !is_video()},
                {"bytes", folder_.bytes()},
                {"frames_dropped", writer_.dropped()},
                {"cameras", cameras_json()},
                {"end", !source_.fault().empty() ? "input failed"
                        : is_interrupted         ? "interrupted"
                                                 : "complete"},
                {"fault", source_.fault()},
                {"left", shown_source(options_.source.left)},
                {"right", shown_source(options_.source.right)},
                {"stereo", shown_source(options_.source.stereo)},
                {"bag", options_.source.bag.path},
                {"run", folder_.run()}};
    }

    void report(const Json& summary) const {
        const auto dropped = summary["frames_dropped"].get<std::int64_t>();
        if (!source_.fault().empty()) print_notice(source_.fault());
        const std::optional<BagFacts> bag = source_.bag_facts();
        if (bag && !bag->remark().empty()) print_notice(bag->remark());
        if (dropped > 0)
            print_notice(std::to_string(dropped) + (dropped == 1 ? " frame was" : " frames were") +
                         " dropped, because the disk or the processor was too slow.");
        if (options_.json) {
            print(json_text(summary, 2) + "\n");
        } else if (!options_.quiet) {
            constexpr double kMegabyte = 1e6;
            print(std::to_string(writer_.written()) + " frames of " +
                  size_text(source_.width(), source_.height()) + ", " +
                  format_fixed(static_cast<double>(folder_.bytes()) / kMegabyte, 1) + " MB, in " +
                  options_.out +
                  (is_video() ? "\nH.264 is lossy: results are not those of the source" : "") +
                  "\nreplay: defrec track --recording " + options_.out +
                  " --calibration F --out DIR\n");
        }
    }

    const RecordOptions options_;
    FrameSource source_;
    ProgressBar progress_;
    RecordingFolder folder_;
    FrameWriter writer_;  // ends before the folder
};

}  // namespace

int run_record(const RecordOptions& options) {
    try {
        return Recording(options).run();
    } catch (const FileError& error) {
        throw CliError(ExitCode::kOutput, error.what());
    }
}

}  // namespace defrec::cli
