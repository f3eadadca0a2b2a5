// Sequences as `defrec render` writes them, scored as `defrec score` does.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "sdk/evaluation/data_sets/data_set.hpp"
#include "sdk/evaluation/data_sets/opencv_method.hpp"
#include "sdk/evaluation/data_sets/tracked_clip.hpp"
#include "sdk/evaluation/score/score.hpp"
#include "sdk/evaluation/score/target_score.hpp"
#include "sdk/io/csv.hpp"
#include "sdk/io/terminal.hpp"
#include "sdk/io/text.hpp"
#include "sdk/session/frame_projection.hpp"
#include "sdk/session/track_outputs.hpp"

namespace defrec::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr PointStatus kStatuses[] = {PointStatus::kTracked, PointStatus::kExtrapolated,
                                     PointStatus::kLost};

// Columns of the samples. The last two are of targets alone.
enum Column { kFrame, kVisible, kStatus, kErrorMm, kErrorPx, kExpectedMm, kDepth, kRigidMm };

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
                     row.error_px.value_or(kNone), row.expected_mm.value_or(kNone), kNone, kNone});
    }
    return samples;
}

void add_targets(const std::vector<ScoredTarget>& targets, Samples& samples) {
    for (const ScoredTarget& target : targets) {
        samples.add({static_cast<double>(target.frame), 0, number_of(target.status),
                     target.error_mm.value_or(kNone), kNone, target.expected_mm.value_or(kNone),
                     target.depth, target.rigid_mm.value_or(kNone)});
    }
}

bool is_target(const Samples& samples, std::size_t i) { return !std::isnan(samples.at(i, kDepth)); }

std::optional<double> optional_at(const Samples& samples, std::size_t i, Column column) {
    const double value = samples.at(i, column);
    return std::isnan(value) ? std::nullopt : std::optional(value);
}

// What points and targets have in common.
void fill_position(const Samples& samples, std::size_t i, ScoredPosition& position) {
    position.frame = static_cast<std::int64_t>(samples.at(i, kFrame));
    position.status = name_of(static_cast<PointStatus>(samples.at(i, kStatus)));
    position.error_mm = optional_at(samples, i, kErrorMm);
    position.expected_mm = optional_at(samples, i, kExpectedMm);
}

ScoredRows rows_of(const Samples& samples) {
    ScoredRows scored;
    scored.has_pixels = true;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        if (is_target(samples, i)) continue;
        ScoredRow row;
        fill_position(samples, i, row);
        row.truly_visible = samples.at(i, kVisible) != 0;
        row.error_px = optional_at(samples, i, kErrorPx);
        scored.rows.push_back(std::move(row));
    }
    return scored;
}

std::vector<ScoredTarget> targets_of(const Samples& samples) {
    std::vector<ScoredTarget> targets;
    for (std::size_t i = 0; i < samples.size(); ++i) {
        if (!is_target(samples, i)) continue;
        ScoredTarget target;
        fill_position(samples, i, target);
        target.depth = samples.at(i, kDepth);
        target.rigid_mm = optional_at(samples, i, kRigidMm);
        targets.push_back(std::move(target));
    }
    return targets;
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
                                       const TrackOptions& options, std::int64_t frame) {
    StereoCalibration calibration = load_calibration(options.calibration, options.units);
    const FrameSource reader(options.source);
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

// The clip's files by their names in it: where the root lies changes no result.
std::string within_clip(std::string text, const fs::path& clip) {
    const std::string folder = (clip / "").string();
    for (std::size_t at = text.find(folder); at != std::string::npos; at = text.find(folder, at))
        text.erase(at, folder.size());
    return text;
}

// What of a truth does not fit, for the clip's score.
class TruthRemarks {
  public:
    explicit TruthRemarks(const fs::path& clip) : clip_(clip) {}

    void add(const std::vector<std::string>& notes, const TruthDoubt& doubt) {
        append(doubt.note, doubt_);
        for (const std::string& note : notes) {
            print_notice(note);  // into the clip's log
            if (note != doubt.note) append(note, notes_);
        }
    }
    const std::string& doubt() const { return doubt_; }
    const std::string& notes() const { return notes_; }

  private:
    void append(const std::string& note, std::string& text) const {
        if (!note.empty()) text.append(text.empty() ? "" : " ").append(within_clip(note, clip_));
    }

    const fs::path& clip_;
    std::string doubt_, notes_;
};

// Throws where the truth has a frame that the recording does not.
void refuse_frames_beyond(const ScoredRows& scored, const fs::path& truth, const fs::path& out) {
    std::error_code error;
    const fs::path frames = out / kFramesFile;
    CsvReader csv(fs::exists(frames, error) ? frames : out / kFrameTimesFile, {"frame"});
    std::int64_t last = -1;
    while (csv.next()) last = std::max(last, csv.integer(0));
    const auto beyond =
        std::find_if(scored.rows.begin(), scored.rows.end(),
                     [last](const ScoredRow& row) { return row.frame < 0 || row.frame > last; });
    if (beyond == scored.rows.end()) return;
    throw CliError(
        ExitCode::kInput,
        truth.string() + ": it asks for frame " + std::to_string(beyond->frame) +
            ", and the recording has " + std::to_string(last + 1) + " frames, counted from 0: " +
            (scored.doubt.note.empty() ? std::string("is it the truth of another recording?")
                                       : within_clip(scored.doubt.note, truth.parent_path())));
}

class DefrecSequences : public DataSet {
  public:
    std::string name() const override { return "defrec"; }
    bool has_units() const override { return true; }
    std::string summary() const override {
        return "sequences as `defrec render` writes them: 3D points with visibility";
    }
    std::string layout() const override {
        return "folders, at any depth, that hold left/, right/, calibration.yaml, points.csv and "
               "truth.csv, and for targets beneath the surface targets.csv and truth_deep.csv";
    }
    bool is_clip(const fs::path& folder) const override {
        std::error_code error;
        return fs::exists(folder / "truth.csv", error) ||
               fs::exists(folder / "calibration.yaml", error);
    }

    std::vector<std::string> sample_columns() const override {
        return {"frame",    "visible",     "status", "error_mm",
                "error_px", "expected_mm", "depth",  "rigid_mm"};
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

    std::vector<Metric> depth_metrics() const override {
        return {{"points"},
                {"median_mm"},
                {"p95_mm"},
                {"max_mm"},
                {"mean_expected_mm"},
                {"within_1_expected", true},
                {"within_2_expected", true},
                {"within_3_expected", true},
                {"lost_share"},
                {"rigid_median_mm"},
                {"rigid_p95_mm"}};
    }
    std::vector<DepthValues> by_depth(const Samples& samples) const override {
        std::vector<DepthValues> values;
        for (const DepthScore& depth : target_score_of({targets_of(samples), {}}).depths) {
            const ErrorSummary& errors = depth.all.errors;
            const Coverage& coverage = depth.all.coverage;
            values.push_back(
                {depth.name(),
                 {static_cast<double>(depth.rows), errors.median, errors.p95, errors.max,
                  depth.all.mean_expected_mm, coverage.within[0], coverage.within[1],
                  coverage.within[2], depth.lost_share(), depth.rigid.median, depth.rigid.p95}});
        }
        return values;
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
        options.units = task.settings.units;
        options.points = (clip / "points.csv").string();
        std::error_code error;
        const bool has_targets =
            fs::exists(clip / kTargetsFile, error) && fs::exists(clip / kDeepTruthFile, error);
        if (has_targets) options.targets = (clip / kTargetsFile).string();
        track_clip(task, options);
        const ScoredRows scored =
            read_scored_rows(task.out, clip / "truth.csv", {}, Unfollowed::kLost);
        TruthRemarks remarks(clip);
        remarks.add(scored.notes, scored.doubt);
        refuse_frames_beyond(scored, clip / "truth.csv", task.out);
        ClipScore score{samples_of(scored, sample_columns()), 0, {}, {}, {}};
        if (fs::exists(task.out / kTargetsFile, error)) {
            const ScoredTargets targets =
                read_scored_targets(task.out / kTargetsFile, clip / kDeepTruthFile,
                                    clip / "truth.csv", {}, Unfollowed::kLost);
            remarks.add(targets.notes, targets.doubt);
            add_targets(targets.rows, score.samples);
        }
        score.doubt = remarks.doubt();
        score.notes = remarks.notes();
        set_times(task.out, score);
        const WorstFrame worst = worst_frame(score.samples);
        score.picture = picture_of(options.source, worst.frame,
                                   marked_points(clip, task.out, options, worst.frame));
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
