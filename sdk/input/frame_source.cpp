// Pairs of left and right images.
#include "sdk/input/frame_source.hpp"

#include <algorithm>
#include <array>
#include <opencv2/imgproc.hpp>

#include "sdk/input/camera_name.hpp"
#include "sdk/input/camera_source.hpp"
#include "sdk/input/image_stream.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr double kDefaultFps = 30;
constexpr std::int64_t kMaxFrames = 1'000'000'000;

struct Pair {
    cv::Mat left, right;
    double time_ms = 0;  // of cameras
    // What the images show, where they do not own their pixels.
    std::array<std::shared_ptr<const void>, 2> memory;
};

bool is_camera(const std::string& source) {
    return parse_camera(source).kind != CameraName::Kind::kNone;
}

std::string size_text(const cv::Mat& image) { return cli::size_text(image.cols, image.rows); }

ImageView view_of(const cv::Mat& image) {
    return {image.data, image.cols, image.rows, image.channels(), image.step[0]};
}

std::string digits_of(const std::filesystem::path& file) {
    std::string digits;
    for (const char c : file.stem().string()) {
        if (c >= '0' && c <= '9') digits += c;
    }
    return digits;
}

// Files are paired by their place in the order; a file lost on one side would pair all that follow
// wrongly.
void require_pairs(const ImageStream& left, const ImageStream& right) {
    const auto& a = left.files();
    const auto& b = right.files();
    if (a.empty() || b.empty()) return;
    const std::size_t common = std::min(a.size(), b.size());
    for (std::size_t i = 0; i < common; ++i) {
        if (digits_of(a[i]) == digits_of(b[i])) continue;
        // Two cameras may count from different starts; then no name agrees.
        if (i == 0) break;
        throw CliError(ExitCode::kInput,
                       a[i].string() + " would be paired with " + b[i].string() +
                           ": an image is missing on one side. Remove its partner.");
    }
    if (a.size() != b.size()) {
        throw CliError(ExitCode::kInput, "there are " + std::to_string(a.size()) +
                                             " images on the left (" + left.source() + ") and " +
                                             std::to_string(b.size()) + " on the right (" +
                                             right.source() + "); they must pair up.");
    }
}

}  // namespace

FrameRange parse_frame_range(const std::string& text) {
    const std::vector<std::string_view> parts = split(text, ':');
    const auto bound = [&](std::string_view part) {
        const std::optional<std::int64_t> value = parse_integer(part);
        if (!value || *value < 0 || *value > kMaxFrames) {
            throw CliError(ExitCode::kUsage,
                           "--frames: '" + text +
                               "' is not of the form A:B, A: or :B (frames A to B-1, "
                               "counted from 0).");
        }
        return *value;
    };
    if (parts.size() != 2) bound("");
    FrameRange range;
    if (!parts[0].empty()) range.first = bound(parts[0]);
    if (!parts[1].empty()) range.last = bound(parts[1]);
    if (range.last && *range.last <= range.first) {
        throw CliError(ExitCode::kUsage,
                       "--frames: '" + text + "' is empty; the first number must be the smaller.");
    }
    return range;
}

struct FrameSource::Impl {
    SourceOptions options;
    std::unique_ptr<ImageStream> left, right;  // right is null for a source that carries both
    std::unique_ptr<CameraSource> cameras;     // instead of both
    std::optional<double> first_ms;            // time of the first frame, of cameras
    std::int64_t position = 0;                 // index of the next frame
    double fps = kDefaultFps;
    std::string fault;
    std::optional<Pair> first;  // read at opening, to know the size
    cv::Size size;
    int channels = 3;

    void open() {
        open_sources();
        for (; position < options.range.first; ++position) {
            if (!skip()) {
                throw CliError(ExitCode::kInput, source_name() + ": --frames begins at frame " +
                                                     std::to_string(options.range.first) +
                                                     " but there are only " +
                                                     std::to_string(position) + ".");
            }
        }
        Pair pair;
        if (!read_pair(pair)) {
            throw CliError(ExitCode::kInput, fault.empty()
                                                 ? source_name() + ": not one frame could be read."
                                                 : fault);
        }
        if (pair.left.size() != pair.right.size()) {
            throw CliError(ExitCode::kInput, "the left image is " + size_text(pair.left) +
                                                 " and the right image " + size_text(pair.right) +
                                                 "; they must be of one size.");
        }
        const double own = cameras ? cameras->fps() : left->fps();
        fps = options.fps > 0 ? options.fps : own > 0 ? own : kDefaultFps;
        size = pair.left.size();
        channels = std::max(pair.left.channels(), pair.right.channels());
        first = std::move(pair);
    }

    void open_sources() {
        const bool is_one = !options.stereo.empty();
        const std::vector<std::string> names =
            is_one ? std::vector{options.stereo} : std::vector{options.left, options.right};
        const auto live = std::count_if(names.begin(), names.end(), &is_camera);
        if (live == static_cast<std::ptrdiff_t>(names.size())) {
            cameras = std::make_unique<CameraSource>(
                CameraOptions{names, options.fps, options.reconnect_seconds});
            return;
        }
        if (live > 0) {
            throw CliError(ExitCode::kInput, "one of " + options.left + " and " + options.right +
                                                 " is a camera and the other is not.");
        }
        left = ImageStream::open(names.front());
        if (is_one) return;
        right = ImageStream::open(names.back());
        require_pairs(*left, *right);
    }

    // Name of the left view, or of the source that carries both.
    const std::string& source_name() const {
        return options.stereo.empty() ? options.left : options.stereo;
    }

    bool skip() {
        if (!cameras) return left->skip() && (!right || right->skip());
        CameraPair ignored;
        return cameras->read(ignored);
    }

    bool read_pair(Pair& pair) {
        if (cameras) return read_cameras(pair);
        const bool has_left = left->read(pair.left);
        if (!right) {
            if (!has_left) fault = left->fault();
            return has_left && split_views(pair);
        }
        const bool has_right = right->read(pair.right);
        if (has_left && has_right) return true;
        fault = !left->fault().empty() ? left->fault() : right->fault();
        if (fault.empty() && has_left != has_right) {
            fault = (has_left ? right : left)->source() + ": it ends after " +
                    std::to_string(position) + " frames, but the other view goes on.";
        }
        return false;
    }

    bool read_cameras(Pair& pair) {
        CameraPair images;
        if (!cameras->read(images)) {
            fault = cameras->fault();
            return false;
        }
        pair = {images.left.image,
                images.right.image,
                images.left.time_ms,
                {images.left.memory, images.right.memory}};
        return options.stereo.empty() || split_views(pair);
    }

    bool split_views(Pair& pair) {
        const cv::Mat both = pair.left;
        const bool is_wide = options.layout == Layout::kSideBySide;
        if ((is_wide ? both.cols : both.rows) % 2 != 0) {
            fault = source_name() + ": an image of " + size_text(both) +
                    " cannot be cut into two halves" +
                    (is_wide ? " side by side." : " one above the other.");
            return false;
        }
        const int width = is_wide ? both.cols / 2 : both.cols,
                  height = is_wide ? both.rows : both.rows / 2;
        pair.left = both(cv::Rect(0, 0, width, height));
        pair.right = both(cv::Rect(both.cols - width, both.rows - height, width, height));
        return true;
    }

    bool has_size(const Pair& pair) {
        for (const cv::Mat* image : {&pair.left, &pair.right}) {
            if (image->size() == size) continue;
            const bool is_right = image == &pair.right && options.stereo.empty();
            fault = (is_right ? options.right : source_name()) + ": frame " +
                    std::to_string(position) + " is " + size_text(*image) + ", those before are " +
                    cli::size_text(size.width, size.height) + "; the size must not change.";
            return false;
        }
        return true;
    }

    void unify_channels(cv::Mat& image) const {
        if (image.channels() == channels) return;
        cv::Mat converted;
        cv::cvtColor(image, converted, channels == 3 ? cv::COLOR_GRAY2BGR : cv::COLOR_BGR2GRAY);
        image = converted;
    }
};

FrameSource::FrameSource(const SourceOptions& options) : impl_(std::make_unique<Impl>()) {
    impl_->options = options;
    impl_->open();
}

FrameSource::~FrameSource() = default;

int FrameSource::width() const { return impl_->size.width; }
int FrameSource::height() const { return impl_->size.height; }
int FrameSource::channels() const { return impl_->channels; }
double FrameSource::fps() const { return impl_->fps; }
const std::string& FrameSource::fault() const { return impl_->fault; }

bool FrameSource::is_live() const { return impl_->cameras != nullptr; }

std::optional<CameraCounts> FrameSource::camera_counts() const {
    return is_live() ? std::optional(impl_->cameras->counts()) : std::nullopt;
}

void FrameSource::set_notice_handler(std::function<void(const std::string&)> handler) {
    if (is_live()) impl_->cameras->set_notice_handler(std::move(handler));
}

std::optional<std::int64_t> FrameSource::expected() const {
    std::optional<std::int64_t> end = is_live() ? std::nullopt : impl_->left->claimed();
    if (impl_->right && impl_->right->claimed())
        end = std::min(end.value_or(kMaxFrames), *impl_->right->claimed());
    if (impl_->options.range.last)
        end = std::min(end.value_or(kMaxFrames), *impl_->options.range.last);
    if (!end) return std::nullopt;
    return std::max<std::int64_t>(0, *end - impl_->options.range.first);
}

bool FrameSource::next(StereoFrame& frame) {
    Impl& impl = *impl_;
    if (!impl.fault.empty()) return false;
    if (impl.options.range.last && impl.position >= *impl.options.range.last) return false;
    auto pair = std::make_shared<Pair>();
    if (impl.first) {
        *pair = std::move(*impl.first);
        impl.first.reset();
    } else if (!impl.read_pair(*pair) || !impl.has_size(*pair)) {
        return false;
    }
    impl.unify_channels(pair->left);
    impl.unify_channels(pair->right);
    frame.index = impl.position++;
    if (!impl.first_ms) impl.first_ms = pair->time_ms;
    frame.timestamp_ms = impl.cameras ? pair->time_ms - *impl.first_ms
                                      : static_cast<double>(frame.index) * 1000.0 / impl.fps;
    frame.left = view_of(pair->left);
    frame.right = view_of(pair->right);
    frame.pixels = std::move(pair);
    return true;
}

}  // namespace defrec::cli
