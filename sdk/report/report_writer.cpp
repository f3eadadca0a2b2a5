// Collects what the page shows and writes it.
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <utility>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/report/doubtful_frames.hpp"
#include "sdk/report/key_frames.hpp"
#include "sdk/report/page.hpp"
#include "sdk/report/page_json.hpp"
#include "sdk/report/picture_gaps.hpp"
#include "sdk/report/point_history.hpp"
#include "sdk/report/report.hpp"
#include "sdk/report/surface_history.hpp"
#include "sdk/report/thinning.hpp"
#include "sdk/report/told_state.hpp"

namespace defrec::cli {
namespace {

using nlohmann::json;

constexpr std::size_t kPlotSamples = 4096;
constexpr std::size_t kListedChanges = 100;
constexpr int kPictureWidth = 720;
constexpr std::size_t kMaxStages = 24;

/// Order in which states win when frames are merged in a plot; unknown names come last.
constexpr const char* kStates[] = {"tracking", "found",        "relocalised", "initialising",
                                   "degraded", "large-errors", "unseen",      "one-view",
                                   "stalled",  "unfound",      "given-up",    "lost"};

/// Their lists in the page's data, by Doubt.
constexpr const char* kDoubts[] = {"losses", "frozen", "unusable", "degraded"};

double severity(const std::string& state) {
    for (std::size_t i = 0; i < std::size(kStates); ++i)
        if (state == kStates[i]) return static_cast<double>(i);
    return static_cast<double>(std::size(kStates));
}

std::vector<std::uint8_t> jpeg(const cv::Mat& image, int quality) {
    std::vector<std::uint8_t> bytes;
    cv::imencode(".jpg", image, bytes,
                 {cv::IMWRITE_JPEG_QUALITY, quality, cv::IMWRITE_JPEG_OPTIMIZE, 1});
    return bytes;
}

cv::Mat colour_copy(const cv::Mat& image) {
    cv::Mat copy;
    if (image.channels() == 1)
        cv::cvtColor(image, copy, cv::COLOR_GRAY2BGR);
    else
        image.copyTo(copy);
    return copy;
}

cv::Mat shrunk(const cv::Mat& image, int width) {
    if (image.cols <= width) return image;
    cv::Mat small;
    cv::resize(image, small, cv::Size(width, cvRound(double(image.rows) * width / image.cols)), 0,
               0, cv::INTER_AREA);
    return small;
}

std::vector<std::pair<std::string, double>> stage_totals(const FrameRecord& frame) {
    std::vector<std::pair<std::string, double>> totals;
    for (const auto& stage : frame.stage_ms) {
        const auto same = std::find_if(totals.begin(), totals.end(), [&](const auto& total) {
            return total.first == stage.first;
        });
        if (same == totals.end())
            totals.push_back(stage);
        else
            same->second += stage.second;
    }
    return totals;
}

json quantiles(const Distribution& distribution) {
    if (distribution.count() == 0) return nullptr;
    return {{"median", distribution.quantile(0.5)}, {"p99", distribution.quantile(0.99)}};
}

}  // namespace

struct ReportWriter::Impl {
    AtomicFile file;
    ReportMeta meta;
    OverlayPainter painter;
    SurfaceHistory surface;
    PointHistory points, plan;
    KeyFrames pictures;
    Series series{kPlotSamples};
    std::vector<std::uint8_t> texture;
    int texture_width = 0, texture_height = 0;

    std::int64_t frames = 0;
    double first_ms = 0, last_ms = 0;
    ToldState told_state;
    std::string told, last_told;  // of this frame and of the one before
    PictureGaps gaps;
    std::map<std::string, std::int64_t> frames_by_state;
    std::array<DoubtfulFramesList, std::size(kDoubts)> doubtful;
    Distribution frame_ms, residual_mm, observed_share;
    std::vector<std::pair<std::string, Distribution>> stages;
    json changes = json::array();
    std::int64_t unlisted_changes = 0;

    Impl(const std::filesystem::path& path, ReportMeta given, const Projector& projector,
         OverlayDetail detail)
        : file(path),
          meta(std::move(given)),
          painter(projector, detail),
          points(projector),
          plan(projector) {}

    void count(const FrameRecord& frame);
    void count_state(const FrameRecord& frame);
    void plot(const FrameRecord& frame);
    void note_change(const FrameRecord& frame);
    void take_picture(const cv::Mat& left, const FrameRecord& frame);
    json doubts() const;
    json summary() const;
};

void ReportWriter::Impl::count_state(const FrameRecord& frame) {
    ++frames_by_state[told];
    const auto doubt = static_cast<std::size_t>(doubt_of(told));
    const char* lost = told == "unfound" ? "unfound" : "lost";
    // The tracker's own reasons do not explain a state that it does not have.
    const bool is_by_points = told == "degraded" && frame.state != "degraded";
    const std::string reasons = is_by_points ? kPointErrorReason : reasons_told(frame, told);
    for (std::size_t i = 0; i < doubtful.size(); ++i) {
        const char* state = i != doubt ? "tracking" : i == 0 ? lost : "degraded";
        doubtful[i].add(frame.index, state, reasons, frame.faulty_views);
    }
}

void ReportWriter::Impl::count(const FrameRecord& frame) {
    if (frames == 0) first_ms = frame.timestamp_ms;
    last_ms = frame.timestamp_ms;
    ++frames;
    gaps.add(frame.timestamp_ms, frame.reasons);
    count_state(frame);
    if (frame.frame_ms > 0) frame_ms.add(frame.frame_ms);
    if (!frame.vertices.empty()) {
        if (std::isfinite(frame.mean_residual_mm)) residual_mm.add(frame.mean_residual_mm);
        observed_share.add(frame.observed_share);
    }
    for (const auto& [name, ms] : stage_totals(frame)) {
        std::size_t i = 0;
        while (i < stages.size() && stages[i].first != name) ++i;
        if (i == kMaxStages) continue;
        if (i == stages.size()) stages.emplace_back(name, Distribution());
        stages[i].second.add(ms);
    }
}

void ReportWriter::Impl::plot(const FrameRecord& frame) {
    using Worst = Series::Worst;
    series.begin(frame.index, frame.timestamp_ms);
    const auto set = [this](const std::string& name, Worst worst, double value) {
        series.set(series.line(name, worst), value);
    };
    set("state", Worst::largest, severity(told));
    set("residual_mm", Worst::largest, frame.mean_residual_mm);
    set("features", Worst::smallest, frame.features);
    set("matches", Worst::smallest, frame.matches);
    set("inliers", Worst::smallest, frame.inliers);
    set("observed_share", Worst::smallest, frame.observed_share);
    set("frame_ms", Worst::largest, frame.frame_ms > 0 ? frame.frame_ms : std::nan(""));
    if (const PointErrors errors = point_errors(frame); errors.chosen > 0) {
        set("points_median_mm", Worst::largest, errors.median_mm);
        set("points_largest_mm", Worst::largest, errors.largest_mm);
        set("points_lost", Worst::largest, static_cast<double>(errors.lost));
    }
    for (const auto& [name, ms] : stage_totals(frame))
        for (const auto& stage : stages)
            if (stage.first == name) set("stage " + name, Worst::largest, ms);
}

void ReportWriter::Impl::note_change(const FrameRecord& frame) {
    if (frames > 1 && told == last_told) return;
    if (changes.size() < kListedChanges)
        changes.push_back({{"frame", frame.index},
                           {"ms", frame.timestamp_ms},
                           {"state", told},
                           {"reasons", reasons_told(frame, told)},
                           {"faulty_views", frame.faulty_views}});
    else
        ++unlisted_changes;
}

void ReportWriter::Impl::take_picture(const cv::Mat& left, const FrameRecord& frame) {
    if (left.empty() || !pictures.wants(frame.index, told)) return;
    cv::Mat canvas = colour_copy(left);
    painter.draw(canvas, frame, told);
    KeyFrame picture;
    picture.frame = frame.index;
    picture.timestamp_ms = frame.timestamp_ms;
    picture.state = told;
    picture.reasons = reasons_told(frame, told);
    picture.faulty_views = frame.faulty_views;
    picture.jpeg = jpeg(shrunk(canvas, kPictureWidth), 78);
    pictures.add(std::move(picture));
}

json ReportWriter::Impl::doubts() const {
    json result = json::object();
    for (std::size_t i = 0; i < doubtful.size(); ++i) {
        json& told_of = result[kDoubts[i]] = json::array();
        for (const DoubtfulFrames& each : doubtful[i].sorted())
            if (told_of.size() < kDoubtfulFramesSaid)
                told_of.push_back({{"where", each.where()}, {"why", each.why}});
    }
    return result;
}

json ReportWriter::Impl::summary() const {
    json states = json::array();
    for (const auto& [name, number] : frames_by_state)
        states.push_back({{"name", name}, {"frames", number}});
    json stage_list = json::array();
    for (const auto& [name, distribution] : stages)
        stage_list.push_back({{"name", name}, {"ms", quantiles(distribution)}});
    json result = doubts();
    result.update({{"frames", frames},
                   {"duration_ms", last_ms - first_ms - gaps.total_ms()},
                   {"gaps", to_json(gaps)},
                   {"states", states},
                   {"frame_ms", quantiles(frame_ms)},
                   {"residual_mm", quantiles(residual_mm)},
                   {"observed_share", quantiles(observed_share)},
                   {"stages", stage_list},
                   {"changes", changes},
                   {"unlisted_changes", unlisted_changes},
                   {"state_order", kStates}});
    return result;
}

ReportWriter::ReportWriter(const std::filesystem::path& path, ReportMeta meta, Projector projector,
                           OverlayDetail detail)
    : impl_(std::make_unique<Impl>(path, std::move(meta), std::move(projector), detail)) {}

ReportWriter::~ReportWriter() = default;

ReportMeta& ReportWriter::meta() { return impl_->meta; }

void ReportWriter::set_template(const TemplateRecord& reference, const cv::Mat& left_bgr) {
    impl_->painter.set_template(reference);
    impl_->surface.set_template(reference);
    impl_->texture.clear();
    if (left_bgr.empty()) return;
    impl_->texture = jpeg(shrunk(left_bgr, 1024), 85);
    impl_->texture_width = left_bgr.cols;
    impl_->texture_height = left_bgr.rows;
}

void ReportWriter::change_template(const TemplateRecord& reference) {
    impl_->painter.set_template(reference);
    impl_->surface.change_template(reference);
}

void ReportWriter::add(const cv::Mat& left_bgr, const FrameRecord& frame) {
    impl_->last_told = std::exchange(impl_->told, impl_->told_state.take(frame));
    impl_->count(frame);
    impl_->plot(frame);
    impl_->note_change(frame);
    impl_->surface.add(frame, impl_->told);
    impl_->points.add(frame.index, frame.timestamp_ms, frame.points);
    impl_->plan.add(frame.index, frame.timestamp_ms, points_of_plan(frame.plan));
    impl_->take_picture(left_bgr, frame);
}

void ReportWriter::finish() {
    const json data{{"meta", to_json(impl_->meta)},
                    {"summary", impl_->summary()},
                    {"series", to_json(impl_->series)},
                    {"points", to_json(impl_->points)},
                    {"plan", to_json(impl_->plan)},
                    {"image", {impl_->texture_width, impl_->texture_height}},
                    {"key_frames", to_json(impl_->pictures.sorted())},
                    {"surface", to_json(impl_->surface, impl_->texture, impl_->texture_width,
                                        impl_->texture_height)}};
    for (const std::string_view part : page_before_data()) impl_->file.write(part);
    impl_->file.write(embeddable(data));
    for (const std::string_view part : page_after_data()) impl_->file.write(part);
    impl_->file.commit();
}

}  // namespace defrec::cli
