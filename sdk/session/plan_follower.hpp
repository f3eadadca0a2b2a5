// Follows a registered model and its targets, and writes plan.csv and the meshes of plan/.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sdk/client/library.hpp"
#include "sdk/live_link/frame.hpp"
#include "sdk/report/record.hpp"
#include "sdk/session/frame_projection.hpp"
#include "sdk/session/moved_points.hpp"
#include "sdk/session/plan_options.hpp"
#include "sdk/session/targets.hpp"
#include "sdk/session/track_outputs.hpp"

namespace defrec::cli {

// Throws CliError(kInput) where it is no plan's file, without looking at what it says.
void expect_plan_file(const std::string& path);

// The plan's place in a frame; without geometry there are only the rows, which are lost.
struct PlanFrame {
    std::vector<PlanRow> rows;            // of the targets, then of the parts
    const MovedPoints* points = nullptr;  // the model's vertices, then the targets
};

// Rows of parts without a middle, some of whose vertices are known.
class PartlyKnown {
  public:
    // A row; moved: null where no vertex is known. The row has a middle where all are.
    void add(const MovedPoints* moved, const std::vector<std::uint32_t>& vertices);
    // Such rows among all, 0..1.
    double share() const;
    // Known vertices among all in these rows, in the mean, 0..1; 0 without such rows.
    double known_share() const;

  private:
    std::size_t all_ = 0, rows_ = 0;
    double sum_ = 0;
};

// One thread at a time.
class PlanFollower {
  public:
    // Creates plan.csv in the folder under its temporary name, and empties the folder of meshes
    // there. Borrows the projection.
    PlanFollower(const std::filesystem::path& folder, PlanOptions options,
                 RawProjection& projection);

    // The template that the plan was made for. Frames before it get rows as well, which are lost.
    // Throws CliError(kInput) where the file is damaged or the plan was made for another template.
    void prepare(const Template& surface);
    // The template was given up: every row is lost from the next frame on.
    void forget_template() { is_forgotten_ = true; }
    // job is null where the frame has no result to be trusted. The frame's points are borrowed
    // until the next call.
    PlanFrame add_frame(std::int64_t frame, double timestamp_ms, defrec_job job);
    void commit() { file_.commit(); }

    const PlanOptions& options() const { return options_; }
    // Null before prepare().
    const std::shared_ptr<const PlanModel>& model() const { return model_; }
    std::size_t target_count() const { return target_count_; }
    std::size_t mesh_count() const { return mesh_count_; }
    // Rows of the targets, and of the parts.
    const StatusCounts& target_rows() const { return target_rows_; }
    const StatusCounts& part_rows() const { return part_rows_; }
    // Where the targets lie beside the template's surface; empty before prepare().
    const TargetPlacesNote& places() const { return places_; }
    const PartlyKnown& partly_known() const { return partly_known_; }

  private:
    void move(defrec_job job);
    void write_mesh(std::int64_t frame);
    // The middle of the part's vertices; lost where any of them is.
    void fill_part(std::size_t part, PlanRow& row) const;
    std::vector<PlanRow> rows_of(std::int64_t frame, double timestamp_ms, bool is_placed);

    const PlanOptions options_;
    const std::filesystem::path mesh_folder_;
    RawProjection& projection_;
    PlanFile file_;
    Plan plan_;
    std::shared_ptr<const PlanModel> model_;
    std::vector<std::vector<std::uint32_t>> part_vertices_;
    std::vector<std::pair<std::int64_t, double>> before_;  // frames before prepare()
    MovedPoints moved_;
    std::vector<std::string> target_names_;  // of each, or empty
    std::size_t vertex_count_ = 0, target_count_ = 0, mesh_count_ = 0;
    StatusCounts target_rows_, part_rows_;
    PartlyKnown partly_known_;
    TargetPlacesNote places_;
    bool is_forgotten_ = false;
};

// For pictures. model: the follower's.
void fill_plan(const std::shared_ptr<const PlanModel>& model, const PlanFrame& frame,
               PlanEstimate& plan);
// For receivers.
LinkPlan link_plan(const PlanModel& model, const PlanFrame& frame);

}  // namespace defrec::cli
