// See bag_source.hpp.
#include "sdk/input/bag_source.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "sdk/bag/bag.hpp"
#include "sdk/bag/ros_messages.hpp"
#include "sdk/bag/stereo_topics.hpp"
#include "sdk/input/frame_times.hpp"
#include "sdk/input/ros_image.hpp"
#include "sdk/io/exit_code.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr double kNanosecondsInMillisecond = 1e6;
constexpr double kDefaultFps = 30;
// Images of each view by whose stamps the rate is told, and messages that are looked at for them.
constexpr std::size_t kStampsOfRate = 24;
constexpr std::int64_t kMostLookedAt = 10'000;
// A view that ends so many images before the other has ended early; fewer are those that a recorder
// catches of one view alone when it is stopped.
constexpr std::int64_t kMostAtEnd = 4;

// Recorders write what they receive, which is not in the order of the stamps to an image.
constexpr std::size_t kMostWaiting = 16;

enum View : std::size_t { kLeftView, kRightView, kViews };

// By the stamps' median step; 0 where they do not say.
double rate_of_stamps(std::vector<std::int64_t> stamps) {
    std::sort(stamps.begin(), stamps.end());
    stamps.erase(std::unique(stamps.begin(), stamps.end()), stamps.end());
    std::vector<double> times;
    for (const std::int64_t stamp : stamps)
        times.push_back(static_cast<double>(stamp - stamps.front()) / kNanosecondsInMillisecond);
    return rate_of(times);
}

std::string seconds_text(std::int64_t stamp_ns) {
    constexpr double kNanosecondsInSecond = 1e9;
    constexpr int kDecimals = 6;
    return format_fixed(static_cast<double>(stamp_ns) / kNanosecondsInSecond, kDecimals) + " s";
}

}  // namespace

struct BagSource::Impl {
    explicit Impl(const BagOptions& options)
        : path(options.path),
          files(files_of_bag(options.path)),
          topics(views_of(options, topics_of_bag(files))),
          messages(files) {
        look_at_stamps();
    }

    const std::string path;
    const std::vector<std::filesystem::path> files;
    const StereoTopics topics;
    const std::array<std::string, kViews> info_topics = {camera_info_topic(name_of(kLeftView)),
                                                         camera_info_topic(name_of(kRightView))};
    BagMessages messages;
    FramePairs pairs{kMostWaiting};
    double fps = 0, tolerance_ms = 0;
    std::int64_t first_ns = 0;  // of the left view
    std::array<std::int64_t, kViews> first_of_view_ns{}, images{}, since_pair{};
    std::optional<double> last_ms;                         // of the pairs that were given
    std::array<std::vector<double>, kViews> calibrations;  // of the first camera_info
    std::string changed_info;
    std::string fault;

    const std::string& name_of(View view) const {
        return view == kRightView && topics.right ? topics.right->name : topics.left.name;
    }

    std::optional<View> view_of(const BagMessage& message) const {
        if (message.topic->is_same(topics.left)) return kLeftView;
        if (topics.right && message.topic->is_same(*topics.right)) return kRightView;
        return std::nullopt;
    }

    // Zoom, or another camera: what comes after is not as the first one says.
    void watch_calibration(const BagMessage& message) {
        if (message.topic->type != kCameraInfoType || !changed_info.empty()) return;
        for (const View view : {kLeftView, kRightView}) {
            if (message.topic->name != info_topics[view]) continue;
            const std::optional<RosCameraInfo> info = read_camera_info(message.data);
            if (!info) continue;
            std::vector<double> numbers = info->d;
            numbers.insert(numbers.end(), info->k.begin(), info->k.end());
            numbers.insert(numbers.end(), info->r.begin(), info->r.end());
            numbers.insert(numbers.end(), info->p.begin(), info->p.end());
            if (calibrations[view].empty())
                calibrations[view] = std::move(numbers);
            else if (calibrations[view] != numbers)
                changed_info = message.topic->name;
        }
    }

    // A message that is wrong is met again when it is read.
    void look_at_stamps() {
        std::array<std::vector<std::int64_t>, kViews> stamps;
        BagMessages ahead(files);
        BagMessage message;
        for (std::int64_t i = 0; i < kMostLookedAt && ahead.next(message); ++i) {
            const std::optional<View> view = view_of(message);
            std::int64_t stamp = 0;
            if (view && read_stamp(message, stamp)) stamps[*view].push_back(stamp);
            if (stamps[kLeftView].size() >= kStampsOfRate &&
                (!topics.right || stamps[kRightView].size() >= kStampsOfRate))
                break;
        }
        for (std::size_t view = 0; view < kViews; ++view)
            if (!stamps[view].empty())
                first_of_view_ns[view] =
                    *std::min_element(stamps[view].begin(), stamps[view].end());
        first_ns = first_of_view_ns[kLeftView];
        fps = rate_of_stamps(stamps[kLeftView]);
        // The faster view's: to each image of a slower one belongs one of it.
        const double fastest = std::max(fps, rate_of_stamps(stamps[kRightView]));
        constexpr double kMillisecondsInSecond = 1000;
        tolerance_ms = 0.5 * kMillisecondsInSecond / (fastest > 0 ? fastest : kDefaultFps);
        pairs.set_tolerance(tolerance_ms);
    }

    void add(View view, const BagMessage& message) {
        std::string why;
        StampedImage decoded = decode_ros_image(message, why);
        ++images[view];
        if (!why.empty()) {
            fault = path + ": image " + std::to_string(images[view]) + " of topic " +
                    name_of(view) + " " + why;
            return;
        }
        ++since_pair[view];
        const double time_ms =
            static_cast<double>(decoded.stamp_ns - first_ns) / kNanosecondsInMillisecond;
        CameraImage image{std::move(decoded.image), time_ms, nullptr};
        if (!topics.right)
            pairs.add_pair({std::move(image), {cv::Mat(), time_ms, nullptr}});
        else
            pairs.add(view == kLeftView ? FramePairs::View::kLeft : FramePairs::View::kRight,
                      std::move(image));
    }

    bool accept(const CameraPair& pair) {
        since_pair = {};
        if (last_ms && !(pair.left.time_ms > *last_ms)) {
            constexpr int kDecimals = 3;
            fault = path + ": the stamps of topic " + topics.left.name + " do not grow: after " +
                    format_fixed(*last_ms, kDecimals) + " ms comes " +
                    format_fixed(pair.left.time_ms, kDecimals) +
                    " ms, counted from its first image. Its header.stamp must be the time at which "
                    "the image was taken.";
            return false;
        }
        last_ms = pair.left.time_ms;
        return true;
    }

    void end() {
        pairs.end();
        fault = messages.fault();
        if (!fault.empty()) return;
        if (!topics.right) return;
        if (pairs.counts().pairs == 0) {
            fault = path + ": no images of the two views are of one time: the first of " +
                    topics.left.name + " has the stamp " + seconds_text(first_ns) + ", that of " +
                    topics.right->name + " " + seconds_text(first_of_view_ns[kRightView]) +
                    "; stamps of a pair may differ by " + format_fixed(tolerance_ms, 3) +
                    " ms. Both cameras must stamp by one clock.";
            return;
        }
        for (const View view : {kLeftView, kRightView}) {
            const View other = view == kLeftView ? kRightView : kLeftView;
            if (since_pair[view] <= kMostAtEnd || since_pair[other] > kMostAtEnd) continue;
            fault = path + ": topic " + name_of(other) + " ends after " +
                    std::to_string(images[other]) + " images, but the other view goes on for " +
                    std::to_string(since_pair[view]) + ".";
        }
    }
};

std::string BagFacts::remark() const {
    std::string text;
    if (pairs.unpaired > 0)
        text = std::to_string(pairs.unpaired) +
               (pairs.unpaired == 1 ? " image of the bag has" : " images of the bag have") +
               " no partner in the other view within half of a frame, and " +
               (pairs.unpaired == 1 ? "was" : "were") + " left out.";
    if (changed_info.empty()) return text;
    if (!text.empty()) text += " ";
    return text + "The calibration in topic " + changed_info +
           " changes in the recording, which has one for all frames; choose a part with --frames.";
}

BagSource::BagSource(const BagOptions& options) : impl_(std::make_unique<Impl>(options)) {}

BagSource::~BagSource() = default;

bool BagSource::read(CameraPair& pair) {
    Impl& impl = *impl_;
    BagMessage message;
    while (impl.fault.empty()) {
        if (std::optional<CameraPair> formed = impl.pairs.take()) {
            if (!impl.accept(*formed)) return false;
            pair = std::move(*formed);
            return true;
        }
        if (!impl.messages.next(message)) {
            impl.end();
            return false;
        }
        if (const std::optional<View> view = impl.view_of(message))
            impl.add(*view, message);
        else
            impl.watch_calibration(message);
    }
    return false;
}

const std::string& BagSource::fault() const { return impl_->fault; }

double BagSource::fps() const { return impl_->fps; }

std::int64_t BagSource::claimed() const {
    const auto& [left, right] = impl_->topics;
    const std::uint64_t count = right ? std::min(left.messages, right->messages) : left.messages;
    return static_cast<std::int64_t>(
        std::min<std::uint64_t>(count, std::numeric_limits<std::int32_t>::max()));
}

BagFacts BagSource::facts() const {
    const auto& [left, right] = impl_->topics;
    return {left.name, right ? right->name : std::string(), impl_->pairs.counts(),
            impl_->changed_info};
}

}  // namespace defrec::cli
