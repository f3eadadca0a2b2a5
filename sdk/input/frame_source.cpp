// Pairs of left and right images.
#include "sdk/input/frame_source.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <utility>

#include "sdk/input/bag_source.hpp"
#include "sdk/input/camera_name.hpp"
#include "sdk/input/camera_source.hpp"
#include "sdk/input/frame_times.hpp"
#include "sdk/input/image_stream.hpp"
#include "sdk/input/scan_votes.hpp"
#include "sdk/input/view_image.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr double kDefaultFps = 30;
constexpr std::int64_t kMaxFrames = 1'000'000'000;
// Recorded images that are looked at for fields at most, and pairs of them that must tell some: a
// recording may begin with interlaced images alone.
constexpr std::int64_t kMostLookedAt = 60;
constexpr int kEnoughRecorded = 24;
// The same of a camera, whose images wait meanwhile.
constexpr std::size_t kMostWaiting = 8;
constexpr int kEnoughLive = 3;

struct Pair {
    cv::Mat left, right;
    double time_ms = 0;  // of cameras and bags
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

// Number of the image at that place in the order of the left view's files, by their names; its
// place in a video.
std::int64_t number_of_image(const std::vector<std::optional<std::int64_t>>& numbers,
                             std::int64_t place) {
    const auto at = static_cast<std::size_t>(place);
    return at < numbers.size() ? numbers[at].value_or(place) : place;
}

// A field's picture: its rows, and between them what lies between them.
cv::Mat picture_of_field(const cv::Mat& image, bool is_bottom) {
    cv::Mat picture = image.clone();
    const int first = is_bottom ? 1 : 0, last = image.rows - 1 - (image.rows - 1 - first) % 2;
    for (int y = 1 - first; y < image.rows; y += 2) {
        const cv::Mat above = image.row(std::max(y - 1, first)),
                      below = image.row(std::min(y + 1, last));
        cv::Mat row = picture.row(y);
        cv::addWeighted(above, 0.5, below, 0.5, 0, row);
    }
    return picture;
}

std::string way_out(std::size_t left, std::size_t right) {
    const std::size_t more = std::max(left, right) - std::min(left, right);
    const std::string images = more == 1 ? "image" : std::to_string(more) + " images";
    return "Leave out the last " + images + " of the " + (left > right ? "left" : "right") +
           " view, or its first where it began earlier.";
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
        throw CliError(ExitCode::kInput,
                       "there are " + std::to_string(a.size()) + " images on the left (" +
                           left.source() + ") and " + std::to_string(b.size()) + " on the right (" +
                           right.source() + "); they must pair up. " + way_out(a.size(), b.size()));
    }
}

// Cameras may count from different starts; or images are missing at the start of one side and at
// the end of the other.
std::string remark_on_numbers(const ImageStream& left, const ImageStream& right) {
    const auto& a = left.files();
    const auto& b = right.files();
    if (a.size() < 2 || a.size() != b.size()) return {};
    const auto of_left = numbers_of(a), of_right = numbers_of(b);
    std::int64_t offset = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        if (!of_left[i] || !of_right[i]) return {};
        const std::int64_t here = *of_right[i] - *of_left[i];
        if (here == 0 || (i > 0 && here != offset)) return {};
        offset = here;
    }
    return "The numbers in the names of left and right images differ by " +
           std::to_string(std::abs(offset)) + ": " + a[0].filename().string() +
           " was paired with " + b[0].filename().string() +
           ", and so on. If both cameras count from the same start, these are pictures of "
           "different times.";
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
    std::unique_ptr<BagSource> bag;            // likewise
    std::optional<double> first_ms;            // time of the first frame, of cameras and bags
    std::int64_t position = 0;                 // index of the next frame
    double fps = kDefaultFps;                  // of frames
    std::string fault, pairing_remark;
    std::deque<Pair> ahead;             // read at opening, to know the size and the fields
    std::shared_ptr<const Pair> begun;  // whose later field is the next frame
    std::optional<double> last_ms;      // time of the last frame, of cameras and bags
    const std::vector<double>& times_ms = options.times_ms;  // empty: images are even
    std::optional<DisparityFolder> disparity;
    std::vector<std::optional<std::int64_t>> numbers;  // of the left view's files, with disparity
    std::int64_t with_disparity = 0, without_disparity = 0;  // frames that were delivered
    cv::Size size;
    int channels = 3;

    [[noreturn]] void fail_at_begin() const {
        throw CliError(ExitCode::kInput, !fault.empty() ? fault
                                         : position > 0
                                             ? source_name() + ": there is no frame " +
                                                   std::to_string(options.range.first) +
                                                   ", there are only " + std::to_string(position) +
                                                   ", counted from 0."
                                             : source_name() + ": not one frame could be read.");
    }

    void open() {
        read_times();
        if (options.fields == FieldOrder::kAuto && !is_live()) options.fields = recorded_fields();
        open_sources();
        const std::int64_t of_image = frames_of_image();
        for (; position + of_image <= options.range.first; position += of_image) {
            if (!skip()) fail_at_begin();
        }
        Pair pair;
        if (!read_pair(pair)) fail_at_begin();
        if (pair.left.size() != pair.right.size()) {
            throw CliError(ExitCode::kInput, "the left image is " + size_text(pair.left) +
                                                 " and the right image " + size_text(pair.right) +
                                                 "; they must be of one size.");
        }
        size = pair.left.size();
        channels = std::max(pair.left.channels(), pair.right.channels());
        ahead.push_back(std::move(pair));
        if (options.fields == FieldOrder::kAuto) options.fields = live_fields();
        open_disparity();
        const double own = cameras            ? cameras->fps()
                           : bag              ? bag->fps()
                           : times_ms.empty() ? left->fps()
                                              : rate_of(times_ms);
        fps = options.fps > 0 ? options.fps : own > 0 ? own : kDefaultFps;
        fps *= static_cast<double>(frames_of_image());
        position = options.range.first;
    }

    void open_disparity() {
        if (options.disparity.empty()) return;
        if (is_live())
            throw CliError(ExitCode::kUsage, "--disparity is for recordings: cameras have none.");
        if (frames_of_image() > 1)
            throw CliError(ExitCode::kUsage,
                           "--disparity is of whole images: the fields of interlaced ones are of "
                           "two times. Leave it out, or say with --interlaced off that they are "
                           "not.");
        disparity.emplace(options.disparity);
        if (left != nullptr) numbers = numbers_of(left->files());
        expect_disparity_of_a_frame();
    }

    // Numbers that begin elsewhere would leave all frames without disparity.
    void expect_disparity_of_a_frame() const {
        std::optional<std::int64_t> frames = bag ? bag->claimed() : left->claimed();
        const FrameRange& range = options.range;
        if (range.last) frames = std::min(frames.value_or(*range.last), *range.last);
        if (!frames || *frames <= range.first) return;
        for (std::int64_t place = range.first; place < *frames; ++place)
            if (disparity->has(number_of_image(numbers, place))) return;
        throw CliError(ExitCode::kInput,
                       options.disparity + ": no file is of a frame: the files have the numbers " +
                           std::to_string(disparity->first()) + " to " +
                           std::to_string(disparity->last()) + ", the frames " +
                           std::to_string(number_of_image(numbers, range.first)) + " to " +
                           std::to_string(number_of_image(numbers, *frames - 1)) +
                           ". Name each file by the number of its left image; of a video or a bag, "
                           "by that of its frame, counted from 0.");
    }

    // Fills in the next frame's, if it has some; false: its file is of no use, a fault.
    bool read_disparity(StereoFrame& frame) {
        frame.disparity.reset();
        if (!disparity) return true;
        try {
            frame.disparity =
                disparity->read(number_of_image(numbers, position), size.width, size.height);
        } catch (const CliError& error) {
            fault = error.what();
            return false;
        }
        frame.disparity_sigma_px = options.disparity_sigma_px;
        ++(frame.disparity ? with_disparity : without_disparity);
        return true;
    }

    bool is_live() const { return is_camera(source_name()); }
    std::int64_t frames_of_image() const { return cli::frames_of_image(options.fields); }

    // A fault is met again when the images are opened to be tracked.
    FieldOrder recorded_fields() const {
        SourceOptions whole = options;
        whole.fields = FieldOrder::kProgressive;
        whole.range = {options.range.first / kFieldsOfImage, {}};
        ScanVotes votes(kEnoughRecorded);
        try {
            FrameSource source(whole);
            StereoFrame frame;
            std::shared_ptr<const void> before;  // the pixels that the next ones are compared with
            for (std::int64_t i = 0; i < kMostLookedAt && !votes.is_settled() && source.next(frame);
                 ++i) {
                votes.add(mat_of(frame.left));
                before = frame.pixels;
            }
        } catch (const CliError&) {
            return FieldOrder::kProgressive;
        }
        return votes.order();
    }

    FieldOrder live_fields() {
        ScanVotes votes(kEnoughLive);
        votes.add(ahead.front().left);
        Pair pair;
        while (!votes.is_settled() && ahead.size() < kMostWaiting && read_pair(pair)) {
            votes.add(pair.left);
            ahead.push_back(std::move(pair));
            pair = {};
        }
        return votes.order();
    }

    void read_times() {
        if (options.times.empty()) return;
        if (is_live())
            throw CliError(ExitCode::kUsage, "--times is for recordings: cameras have times.");
        if (options.times_ms.empty()) options.times_ms = read_frame_times(options.times);
    }

    void open_sources() {
        if (options.bag.is_given()) {
            bag = std::make_unique<BagSource>(options.bag);
            return;
        }
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
            throw CliError(ExitCode::kInput, "one of " + shown_source(options.left) + " and " +
                                                 shown_source(options.right) +
                                                 " is a camera and the other is not.");
        }
        left = ImageStream::open(names.front());
        if (is_one) return;
        right = ImageStream::open(names.back());
        require_pairs(*left, *right);
        pairing_remark = remark_on_numbers(*left, *right);
        require_one_rate();
    }

    // Images are paired by their number: at two rates they would be of ever more distant times.
    void require_one_rate() const {
        constexpr double kSameRate = 0.005;  // 29.97 and 30 images a second are one rate
        const double a = left->fps(), b = right->fps();
        if (options.fps > 0 || !(a > 0 && b > 0) || std::abs(a - b) <= kSameRate * a) return;
        std::ostringstream text;
        text << options.left << " has " << a << " images a second and " << options.right << " has "
             << b << ": images of one number are not of one time. Convert one video to the rate of "
             << "the other, or state the rate of both with --fps.";
        throw CliError(ExitCode::kInput, text.str());
    }

    std::string source_name() const { return options.name(); }

    // The recorded frame's; none where there is none, which is a fault.
    std::optional<double> recorded_time() {
        if (times_ms.empty()) return static_cast<double>(position) * 1000.0 / fps;
        const auto image = static_cast<std::size_t>(position / frames_of_image());
        if (image >= times_ms.size()) {
            fault = options.times + ": it ends after the times of " +
                    std::to_string(times_ms.size()) + " images, but the recording goes on.";
            return std::nullopt;
        }
        if (position % frames_of_image() == 0) return times_ms[image];
        // The later field, before the next image where that comes too soon.
        const double time = times_ms[image] + 1000.0 / fps;
        const bool has_next = image + 1 < times_ms.size();
        return has_next && time >= times_ms[image + 1]
                   ? std::midpoint(times_ms[image], times_ms[image + 1])
                   : time;
    }

    // At the end of the images.
    void expect_no_more_times() {
        const auto images = static_cast<std::size_t>(position / frames_of_image());
        if (fault.empty() && images < times_ms.size())
            fault = options.times + ": it has the times of " + std::to_string(times_ms.size()) +
                    " images, but there are only " + std::to_string(images) + ".";
    }

    bool skip() {
        if (bag) {
            Pair ignored;
            return read_bag(ignored);
        }
        if (!cameras) return left->skip() && (!right || right->skip());
        CameraPair ignored;
        return cameras->read(ignored);
    }

    bool read_pair(Pair& pair) {
        if (cameras) return read_cameras(pair);
        if (bag) return read_bag(pair);
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
                    std::to_string(position) +
                    " frames, but the other view goes on. Leave out as many images at the end of "
                    "the longer view as it has more, or at its beginning where it began earlier.";
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

    bool read_bag(Pair& pair) {
        CameraPair images;
        if (!bag->read(images)) {
            fault = bag->fault();
            return false;
        }
        // Counted from the bag's first pair, also where it is passed over.
        if (!first_ms) first_ms = images.left.time_ms;
        pair = {images.left.image, images.right.image, images.left.time_ms, {}};
        return !options.bag.has_stereo_images || split_views(pair);
    }

    bool split_views(Pair& pair) {
        const cv::Mat both = pair.left;
        const bool is_wide = options.layout == Layout::kSideBySide;
        if ((is_wide ? both.cols : both.rows) % 2 != 0) {
            fault = source_name() + ": an image of " + size_text(both) +
                    " cannot be cut into two halves" +
                    (is_wide ? " side by side" : " one above the other") +
                    "; give the other --layout, or images without what is beside the two views.";
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
            const bool is_right = image == &pair.right && !options.right.empty();
            fault = (is_right ? shown_source(options.right) : source_name()) + ": frame " +
                    std::to_string(position) + " is " + size_text(*image) + ", those before are " +
                    cli::size_text(size.width, size.height) + "; the size must not change.";
            return false;
        }
        return true;
    }

    // The image that the next frame is of; null at the end.
    std::shared_ptr<const Pair> next_image() {
        if (begun != nullptr) return std::exchange(begun, nullptr);
        auto pair = std::make_shared<Pair>();
        if (!ahead.empty()) {
            *pair = std::move(ahead.front());
            ahead.pop_front();
        } else if (!read_pair(*pair)) {
            return nullptr;
        }
        if (!has_size(*pair)) return nullptr;
        unify_channels(pair->left);
        unify_channels(pair->right);
        return pair;
    }

    // A frame of an image with a time. Cameras' clocks are not even.
    double time_of(const Pair& pair) {
        constexpr double kLeastStep = 1e-3;  // ms
        if (!first_ms) first_ms = pair.time_ms;
        const bool is_later = frames_of_image() > 1 && position % kFieldsOfImage != 0;
        const double time = pair.time_ms - *first_ms + (is_later ? 1000.0 / fps : 0);
        last_ms = last_ms ? std::max(time, *last_ms + kLeastStep) : time;
        return *last_ms;
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
FieldOrder FrameSource::fields() const { return impl_->options.fields; }
const std::string& FrameSource::fault() const { return impl_->fault; }

bool FrameSource::is_live() const { return impl_->cameras != nullptr; }

std::optional<CameraCounts> FrameSource::camera_counts() const {
    return is_live() ? std::optional(impl_->cameras->counts()) : std::nullopt;
}

std::optional<BagFacts> FrameSource::bag_facts() const {
    return impl_->bag ? std::optional(impl_->bag->facts()) : std::nullopt;
}

const std::string& FrameSource::pairing_remark() const { return impl_->pairing_remark; }

std::string FrameSource::disparity_remark() const {
    if (!impl_->disparity) return {};
    const std::int64_t with = impl_->with_disparity, without = impl_->without_disparity;
    const auto unused = static_cast<std::int64_t>(impl_->disparity->count()) - with;
    const std::string& folder = impl_->options.disparity;
    if (with == 0 && without > 0)
        return "No file of " + folder + " is of a frame that was read: stage stereo measured the " +
               "disparity of all " + std::to_string(without) + ".";
    std::string text;
    if (without > 0)
        text = std::to_string(without) + " of " + std::to_string(with + without) + " frames " +
               (without == 1 ? "has" : "have") + " no file in " + folder +
               "; stage stereo measured the disparity.";
    const FrameRange& range = impl_->options.range;
    if (unused <= 0 || range.first > 0 || range.last) return text;
    if (!text.empty()) text += " ";
    return text + std::to_string(unused) + (unused == 1 ? " file" : " files") + " of " + folder +
           (unused == 1 ? " is" : " are") + " of no frame that was read.";
}

void FrameSource::set_notice_handler(std::function<void(const std::string&)> handler) {
    if (is_live()) impl_->cameras->set_notice_handler(std::move(handler));
}

std::optional<std::int64_t> FrameSource::expected() const {
    std::optional<std::int64_t> end = is_live()    ? std::nullopt
                                      : impl_->bag ? impl_->bag->claimed()
                                                   : impl_->left->claimed();
    if (impl_->right && impl_->right->claimed())
        end = std::min(end.value_or(kMaxFrames), *impl_->right->claimed());
    if (end) *end *= impl_->frames_of_image();
    if (impl_->options.range.last)
        end = std::min(end.value_or(kMaxFrames), *impl_->options.range.last);
    if (!end) return std::nullopt;
    return std::max<std::int64_t>(0, *end - impl_->options.range.first);
}

bool FrameSource::next(StereoFrame& frame) {
    Impl& impl = *impl_;
    if (!impl.fault.empty()) return false;
    if (impl.options.range.last && impl.position >= *impl.options.range.last) return false;
    std::shared_ptr<const Pair> pair = impl.next_image();
    if (pair == nullptr) {
        impl.expect_no_more_times();
        return false;
    }
    const bool has_own_time = impl.cameras || impl.bag;
    const std::optional<double> time = has_own_time ? impl.time_of(*pair) : impl.recorded_time();
    if (!time || !impl.read_disparity(frame)) return false;
    frame.timestamp_ms = *time;
    frame.index = impl.position++;
    frame.field = DEFREC_FIELD_NONE;
    if (impl.frames_of_image() > 1) {
        if (frame.index % kFieldsOfImage == 0) impl.begun = pair;
        const bool is_bottom = is_bottom_field(impl.options.fields, frame.index);
        frame.field = is_bottom ? DEFREC_FIELD_BOTTOM : DEFREC_FIELD_TOP;
        pair = std::make_shared<const Pair>(Pair{picture_of_field(pair->left, is_bottom),
                                                 picture_of_field(pair->right, is_bottom),
                                                 pair->time_ms,
                                                 {}});
    }
    frame.left = view_of(pair->left);
    frame.right = view_of(pair->right);
    frame.pixels = std::move(pair);
    return true;
}

}  // namespace defrec::cli
