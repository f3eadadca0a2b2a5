// The images of one view, one after the other.
#include "sdk/input/image_stream.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <opencv2/videoio.hpp>
#include <system_error>

#include "sdk/input/decode_image.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/image_header.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kLargestImageFile = 400'000'000;
// A container may count one frame more than it holds without being cut short.
constexpr std::int64_t kCountTolerance = 1;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

[[noreturn]] void fail(const std::string& message) { throw CliError(ExitCode::kInput, message); }

bool is_image_name(const fs::path& path) {
    static const std::vector<std::string> kExtensions = {".png",  ".jpg", ".jpeg", ".bmp", ".tif",
                                                         ".tiff", ".pgm", ".ppm",  ".pnm", ".webp"};
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(), [](char c) {
        return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    });
    return path.filename().string().front() != '.' &&
           std::find(kExtensions.begin(), kExtensions.end(), extension) != kExtensions.end();
}

// Empty when the file is no whole image; reason: the system's, where it says why.
cv::Mat decode_file(const fs::path& path, std::string& reason) {
    std::error_code error;
    const std::uintmax_t size = fs::file_size(path, error);
    if (error) reason = error.message();
    if (error || size == 0 || size > kLargestImageFile) return {};
    std::vector<unsigned char> bytes(size);
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"),
                                                               &std::fclose);
    if (!file) {
        reason = std::generic_category().message(errno);
        return {};
    }
    if (std::fread(bytes.data(), 1, bytes.size(), file.get()) != bytes.size()) return {};
    return decode_image(bytes);
}

// Throws CliError(kInput) where the file cannot be opened.
bool is_video(const fs::path& path) {
    unsigned char begin[512] = {};
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"),
                                                               &std::fclose);
    if (!file)
        fail(path.string() + ": the file cannot be opened (" +
             std::generic_category().message(errno) + ").");
    return begins_video({begin, std::fread(begin, 1, sizeof begin, file.get())});
}

class FileStream : public ImageStream {
  public:
    FileStream(std::string source, std::vector<fs::path> files) : files_(std::move(files)) {
        source_ = std::move(source);
        claimed_ = static_cast<std::int64_t>(files_.size());
    }

    bool read(cv::Mat& image) override {
        if (!fault_.empty() || position_ == files_.size()) return false;
        std::string reason;
        image = decode_file(files_[position_], reason);
        if (image.empty() && !reason.empty()) {
            fault_ = files_[position_].string() + ": the file cannot be opened (" + reason + ").";
            return false;
        }
        if (image.empty()) {
            fault_ = files_[position_].string() +
                     ": this is not a whole image that can be read, of sides up to " +
                     std::to_string(kMaxImageSide) + " px.";
            return false;
        }
        ++position_;
        return true;
    }

    bool skip() override {
        if (position_ == files_.size()) return false;
        ++position_;
        return true;
    }

    const std::vector<fs::path>& files() const override { return files_; }

  private:
    std::vector<fs::path> files_;
    std::size_t position_ = 0;
};

class VideoStream : public ImageStream {
  public:
    explicit VideoStream(std::string source) {
        source_ = std::move(source);
        try {
            is_open_ = is_video(source_) && capture_.open(source_, cv::CAP_FFMPEG);
        } catch (const cv::Exception&) {
            is_open_ = false;
        }
        if (!is_open_) {
            fail(source_ +
                 ": this is not a video that can be opened (a recording that was cut off while it "
                 "was being written cannot be); a video file, a folder of images or a %06d pattern "
                 "was expected.");
        }
        const double count = capture_.get(cv::CAP_PROP_FRAME_COUNT);
        if (count > 0 && count < 1e9) claimed_ = std::llround(count);
        const double fps = capture_.get(cv::CAP_PROP_FPS);
        if (fps > 0 && fps < 10000) fps_ = fps;
    }

    bool read(cv::Mat& image) override { return skip() && retrieve(image); }

    bool skip() override {
        bool has_frame = false;
        try {
            has_frame = is_open_ && capture_.grab();
        } catch (const cv::Exception&) {
            has_frame = false;
        }
        if (has_frame) {
            ++delivered_;
        } else {
            end();
        }
        return has_frame;
    }

    const std::vector<fs::path>& files() const override { return files_; }

  private:
    bool retrieve(cv::Mat& image) {
        try {
            // A new buffer each time: the frame before may still be in use.
            cv::Mat decoded;
            if (capture_.retrieve(decoded) && decoded.depth() == CV_8U &&
                (decoded.channels() == 1 || decoded.channels() == 3)) {
                image = decoded;
                return true;
            }
        } catch (const cv::Exception&) {
        }
        --delivered_;
        end();
        return false;
    }

    void end() {
        is_open_ = false;
        if (claimed_ && delivered_ + kCountTolerance < *claimed_) {
            fault_ = source_ + ": the video claims " + std::to_string(*claimed_) +
                     " frames but only " + std::to_string(delivered_) +
                     " could be read; it is cut short or damaged.";
        }
    }

    cv::VideoCapture capture_;
    bool is_open_ = false;
    std::int64_t delivered_ = 0;
    std::vector<fs::path> files_;
};

std::vector<fs::path> images_in(const fs::path& folder) {
    std::vector<fs::path> files;
    std::error_code error;
    for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
         entry.increment(error)) {
        if (entry->is_regular_file() && is_image_name(entry->path()))
            files.push_back(entry->path());
    }
    if (error) fail(folder.string() + ": the folder cannot be read (" + error.message() + ").");
    std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
        return precedes_by_name(a.filename().string(), b.filename().string());
    });
    if (files.empty())
        fail(folder.string() + ": the folder holds no image (png, jpg, bmp, tif, pgm, ppm, webp).");
    return files;
}

struct Pattern {
    std::string prefix, suffix;
    std::size_t digits = 0;  // at least
};

std::optional<Pattern> parse_pattern(const std::string& name) {
    const std::size_t percent = name.find('%');
    if (percent == std::string::npos) return std::nullopt;
    std::size_t end = percent + 1;
    while (end < name.size() && is_digit(name[end])) ++end;
    if (end >= name.size() || name[end] != 'd' || end - percent > 3) return std::nullopt;
    const std::int64_t digits =
        parse_integer(name.substr(percent + 1, end - percent - 1)).value_or(1);
    return Pattern{name.substr(0, percent), name.substr(end + 1), static_cast<std::size_t>(digits)};
}

// The existing files of the pattern, from the lowest number on; a number that is missing in between
// is an error, because from there on left and right could be paired wrongly.
std::vector<fs::path> files_of_pattern(const std::string& source, const fs::path& folder,
                                       const Pattern& pattern) {
    std::vector<std::pair<std::int64_t, fs::path>> numbered;
    std::error_code error;
    for (fs::directory_iterator entry(folder.empty() ? "." : folder, error), end;
         !error && entry != end; entry.increment(error)) {
        const std::string name = entry->path().filename().string();
        if (name.size() < pattern.prefix.size() + pattern.suffix.size() ||
            !name.starts_with(pattern.prefix) || !name.ends_with(pattern.suffix)) {
            continue;
        }
        const std::string digits = name.substr(
            pattern.prefix.size(), name.size() - pattern.prefix.size() - pattern.suffix.size());
        if (digits.size() < pattern.digits || !std::all_of(digits.begin(), digits.end(), is_digit))
            continue;
        if (digits.size() > pattern.digits && digits.front() == '0') continue;
        if (const auto number = parse_integer(digits))
            numbered.emplace_back(*number, entry->path());
    }
    if (error || numbered.empty()) fail(source + ": no file matches this pattern.");
    std::sort(numbered.begin(), numbered.end());
    std::vector<fs::path> files;
    for (const auto& [number, path] : numbered) {
        const std::int64_t expected =
            numbered.front().first + static_cast<std::int64_t>(files.size());
        if (number != expected) {
            fail(source + ": number " + std::to_string(expected) +
                 " is missing; the next file is " + path.filename().string() +
                 ". Renumber the files or give the folder instead.");
        }
        files.push_back(path);
    }
    return files;
}

}  // namespace

std::unique_ptr<ImageStream> ImageStream::open(const std::string& source) {
    std::error_code error;
    const fs::file_status status = fs::status(source, error);
    if (fs::is_directory(status)) return std::make_unique<FileStream>(source, images_in(source));
    if (fs::is_regular_file(status)) return std::make_unique<VideoStream>(source);
    if (fs::exists(status)) fail(source + ": this is neither a file nor a folder.");
    const fs::path path(source);
    if (const std::optional<Pattern> pattern = parse_pattern(path.filename().string())) {
        return std::make_unique<FileStream>(source,
                                            files_of_pattern(source, path.parent_path(), *pattern));
    }
    if (source.starts_with("/dev/"))
        fail(source +
             ": there is no such camera. `ls /dev/video*` lists those of this computer; is it "
             "plugged in, and passed on to a container or virtual machine?");
    fail(source + ": there is no such file or folder.");
}

}  // namespace defrec::cli
