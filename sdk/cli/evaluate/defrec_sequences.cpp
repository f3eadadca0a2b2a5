// Sequences as `defrec render` writes them, scored as `defrec score` does.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "sdk/cli/evaluate/data_set.hpp"
#include "sdk/cli/evaluate/tracked_clip.hpp"
#include "sdk/cli/io/csv.hpp"
#include "sdk/cli/io/text.hpp"
#include "sdk/cli/score/score.hpp"
#include "sdk/cli/track/frame_projection.hpp"
#include "sdk/cli/track/track_outputs.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr PointStatus kStatuses[] = {PointStatus::kTracked, PointStatus::kExtrapolated,
                                     PointStatus::kLost};

// Columns of the samples.
enum Column { kFrame, kVisible, kStatus, kErrorMm, kErrorPx, kExpectedMm };

double number_of(const std::string& status) {
    for (const PointStatus known : kStatuses)
        if (status == name_of(known)) return static_cast<double>(known);
    throw CliError(ExitCode::kInternal, "points.csv has the unknown status '" + status + "'.");
}

Samples samples_of(const ScoredRows& scored, const std::vector<std::string>& columns) {
    Samples samples(columns);
    for (const ScoredRow& row : scored.rows) {
        samples.add({static_cast<double>(row.frame), row.truly_visible ? 1.0 : 0.0,
                     number_of(row.status), row.error_mm.value_or(kNone),
                     row.error_px.value_or(kNone), row.expected_mm.value_or(kNone)});
    }
    return samples;
}

ScoredRows rows_of(const Samples& samples) {
    const auto optional = [](double value) {
        return std::isnan(value) ? std::nullopt : std::optional(value);
    };
    ScoredRows scored;
    scored.has_pixels = true;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        ScoredRow row;
        row.frame = static_cast<std::int64_t>(samples.at(i, kFrame));
        row.truly_visible = samples.at(i, kVisible) != 0;
        row.status = name_of(static_cast<PointStatus>(samples.at(i, kStatus)));
        row.error_mm = optional(samples.at(i, kErrorMm));
        row.error_px = optional(samples.at(i, kErrorPx));
        row.expected_mm = optional(samples.at(i, kExpectedMm));
        scored.rows.push_back(std::move(row));
    }
    return scored;
}

// The frame whose visible points are worst, lost ones worse than any other.
struct WorstFrame {
    std::int64_t frame = 0;
    double median_mm = -1;  // infinite where most are lost
    double lost_share = 0;
};
WorstFrame worst_frame(const Samples& samples) {
    std::map<std::int64_t, std::vector<double>> errors;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        if (samples.at(i, kVisible) == 0) continue;
        const double error = samples.at(i, kErrorMm);
        errors[static_cast<std::int64_t>(samples.at(i, kFrame))].push_back(
            std::isnan(error) ? std::numeric_limits<double>::infinity() : error);
    }
    WorstFrame worst;
    for (auto& [frame, of_frame] : errors) {
        const auto lost =
            std::count(of_frame.begin(), of_frame.end(), std::numeric_limits<double>::infinity());
        const double lost_share = static_cast<double>(lost) / static_cast<double>(of_frame.size());
        const double median = summarise(std::move(of_frame)).median;
        if (median > worst.median_mm) worst = {frame, median, lost_share};
    }
    return worst;
}

std::vector<MarkedPoint> marked_points(const fs::path& clip, const fs::path& out,
                                       const SourceOptions& source, std::int64_t frame) {
    StereoCalibration calibration = load_calibration((clip / "calibration.yaml").string());
    const FrameSource reader(source);
    fit_to_frames(calibration, reader.width(), reader.height());
    const Context context = open_context({1, true, {}});
    const Rig rig = make_rig(context, calibration);
    RawProjection projection(rig);
    std::map<std::int64_t, MarkedPoint> points;
    CsvReader truth(clip / "truth.csv", {"frame", "id", "x", "y", "z", "visible"});
    while (truth.next()) {
        if (truth.integer(0) != frame || truth.integer(5) == 0) continue;
        const double xyz[3] = {truth.number(2), truth.number(3), truth.number(4)};
        double uv[2];
        projection.project(xyz, 1, uv);
        points[truth.integer(1)] = {uv[0], uv[1], kNone, kNone};
    }
    CsvReader found(out / "points.csv", {"frame", "id", "u", "v"});
    while (found.next()) {
        if (found.integer(0) != frame || found.is_empty(2)) continue;
        const auto point = points.find(found.integer(1));
        if (point == points.end()) continue;
        point->second.found_u = found.number(2);
        point->second.found_v = found.number(3);
    }
    std::vector<MarkedPoint> result;
    for (const auto& [id, point] : points) result.push_back(point);
    return result;
}

class DefrecSequences : public DataSet {
  public:
    std::string name() const override { return "defrec"; }
    std::string summary() const override {
        return "sequences as `defrec render` writes them: 3D points with visibility";
    }
    std::string layout() const override {
        return "folders, at any depth, that hold left/, right/, calibration.yaml, points.csv and "
               "truth.csv";
    }
    bool is_clip(const fs::path& folder) const override {
        std::error_code error;
        return fs::exists(folder / "truth.csv", error) ||
               fs::exists(folder / "calibration.yaml", error);
    }

    std::vector<std::string> sample_columns() const override {
        return {"frame", "visible", "status", "error_mm", "error_px", "expected_mm"};
    }
    std::vector<Metric> metrics() const override {
        return {{"median_mm"},
                {"p95_mm"},
                {"mean_mm"},
                {"max_mm"},
                {"lost_share"},
                {"hidden_p95_mm"},
                {"within_1_expected", true},
                {"within_2_expected", true},
                {"within_3_expected", true},
                {"occlusion_accuracy", true},
                {"average_jaccard_mm", true},
                {"average_jaccard_px", true}};
    }
    std::vector<double> summarise(const Samples& samples) const override {
        const ScoreGroup all = score_of(rows_of(samples)).all;
        const Coverage& coverage = all.all_statuses.coverage;
        return {all.visible.median,        all.visible.p95,
                all.visible.mean,          all.visible.max,
                all.lost_share(),          all.hidden.p95,
                coverage.within[0],        coverage.within[1],
                coverage.within[2],        all.visibility.occlusion_accuracy,
                all.visibility.mm.average, all.visibility.px->average};
    }

    ClipScore run(const ClipTask& task) const override {
        const fs::path& clip = task.folder;
        require_entries(clip, {{"left", "the left images of a sequence of `defrec render`", true},
                               {"right", "the right images, in the order of the left ones", true},
                               {"calibration.yaml", "OpenCV stereo YAML, M1 D1 M2 D2 R T in mm"},
                               {"points.csv", "CSV id,u,v: the points to follow"},
                               {"truth.csv", "CSV frame,id,x,y,z,visible: where they are, mm"}});
        TrackOptions options;
        options.source.left = (clip / "left").string();
        options.source.right = (clip / "right").string();
        options.calibration = (clip / "calibration.yaml").string();
        options.points = (clip / "points.csv").string();
        track_clip(task, options);
        const ScoredRows scored = read_scored_rows(task.out, clip / "truth.csv", {});
        ClipScore score{samples_of(scored, sample_columns()), 0, {}, {}, {}};
        set_times(task.out, score);
        const WorstFrame worst = worst_frame(score.samples);
        score.picture = picture_of(options.source, worst.frame,
                                   marked_points(clip, task.out, options.source, worst.frame));
        const std::string median = std::isfinite(worst.median_mm)
                                       ? "median " + format_fixed(worst.median_mm, 2) + " mm"
                                       : "no median";
        score.remark = "frame " + std::to_string(worst.frame) + ": " + median + ", " +
                       format_fixed(100 * worst.lost_share, 0) + " % lost";
        const std::string state = state_of(task.out, worst.frame);
        if (!state.empty()) score.remark += "; " + state;
        return score;
    }
};

}  // namespace

std::unique_ptr<DataSet> make_defrec_sequences() { return std::make_unique<DefrecSequences>(); }

}  // namespace defrec::cli
