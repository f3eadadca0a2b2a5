// See plan_follower.hpp.
#include "sdk/session/plan_follower.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <system_error>

#include "sdk/session/result_record.hpp"
#include "sdk/session/target_follower.hpp"

namespace defrec::cli {
namespace {

std::vector<std::uint32_t> vertices_of(const PlanModel& model, const PlanModel::Part& part) {
    const auto first =
        model.triangles.begin() + static_cast<std::ptrdiff_t>(3 * part.first_triangle);
    std::vector<std::uint32_t> vertices(
        first, first + static_cast<std::ptrdiff_t>(3 * part.triangle_count));
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    return vertices;
}

PlanModel model_of(const defrec_plan_info& info) {
    PlanModel model;
    model.triangles.assign(info.triangles, info.triangles + 3 * info.triangle_count);
    for (std::uint64_t i = 0; i < info.part_count; ++i)
        model.parts.push_back(
            {info.parts[i].name, info.parts[i].first_triangle, info.parts[i].triangle_count});
    return model;
}

LinkPart link_part(const PlanModel& model, std::size_t place, const MovedPoints& points) {
    const PlanModel::Part& part = model.parts[place];
    LinkPart link;
    link.name = part.name;
    link.place = place;
    constexpr std::uint32_t kNone = UINT32_MAX;
    std::vector<std::uint32_t> places(points.status.size(), kNone);  // in the link's vertices
    PositionRow at;
    const auto is_known = [&](std::uint32_t vertex) { return points.fill(vertex, at); };
    for (std::size_t i = 0; i < part.triangle_count; ++i) {
        const auto* corner = &model.triangles[3 * (part.first_triangle + i)];
        if (!std::all_of(corner, corner + 3, is_known)) continue;
        for (std::size_t k = 0; k < 3; ++k) {
            std::uint32_t& vertex = places[corner[k]];
            if (vertex == kNone) {
                vertex = static_cast<std::uint32_t>(link.status.size());
                const double* xyz = &points.xyz[3 * std::size_t{corner[k]}];
                link.vertices.insert(link.vertices.end(), xyz, xyz + 3);
                link.expected_error_mm.push_back(
                    static_cast<float>(points.expected_error_mm[corner[k]]));
                link.status.push_back(points.status[corner[k]]);
            }
            link.triangles.push_back(vertex);
        }
    }
    return link;
}

TargetPlacesNote note_on_targets(const defrec_plan_info& info, const Template& surface) {
    std::vector<Target> targets(info.target_count);
    for (std::size_t i = 0; i < targets.size(); ++i) {
        targets[i].id = static_cast<std::int64_t>(i);
        std::copy_n(info.template_xyz + 3 * (info.vertex_count + i), 3, targets[i].xyz.begin());
    }
    return note_on_places(targets, vertices_of(surface), TargetsOf::kPlan);
}

}  // namespace

void expect_plan_file(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file)
        throw CliError(ExitCode::kInput,
                       path + ": the plan cannot be opened: " +
                           std::error_code(errno, std::generic_category()).message() +
                           ". `defrec register --plan` writes one.");
    std::string head(7, '\0');
    file.read(head.data(), static_cast<std::streamsize>(head.size()));
    if (!file) throw CliError(ExitCode::kInput, path + ": the plan is cut short.");
    if (head != "defrecP")
        throw CliError(ExitCode::kInput,
                       path + ": this is no plan; `defrec register --plan` writes one.");
}

PlanFollower::PlanFollower(const std::filesystem::path& folder, PlanOptions options,
                           RawProjection& projection)
    : options_(std::move(options)),
      mesh_folder_(folder / kPlanFolder),
      projection_(projection),
      file_(folder / kPlanFile) {
    if (options_.mesh_every > 0) empty_mesh_folder(mesh_folder_);
}

void PartlyKnown::add(const MovedPoints* moved, const std::vector<std::uint32_t>& vertices) {
    ++all_;
    if (moved == nullptr) return;
    PositionRow row;
    const auto known = static_cast<std::size_t>(
        std::count_if(vertices.begin(), vertices.end(),
                      [&](std::uint32_t vertex) { return moved->fill(vertex, row); }));
    if (known == 0 || known == vertices.size()) return;
    ++rows_;
    sum_ += static_cast<double>(known) / static_cast<double>(vertices.size());
}

double PartlyKnown::share() const {
    return all_ > 0 ? static_cast<double>(rows_) / static_cast<double>(all_) : 0;
}

double PartlyKnown::known_share() const {
    return rows_ > 0 ? sum_ / static_cast<double>(rows_) : 0;
}

void PlanFollower::prepare(const Template& surface) {
    if (plan_) return;
    defrec_plan handle = nullptr;
    require(defrec_plan_load(surface.get(), options_.file.c_str(), &handle), ExitCode::kInput,
            "reading the plan");
    plan_.reset(handle);
    auto info = initialised<defrec_plan_info>();
    require(defrec_plan_get(handle, &info), ExitCode::kInternal, "reading the plan");
    model_ = std::make_shared<const PlanModel>(model_of(info));
    for (const PlanModel::Part& part : model_->parts)
        part_vertices_.push_back(vertices_of(*model_, part));
    vertex_count_ = info.vertex_count;
    target_count_ = info.target_count;
    target_names_.assign(info.target_names, info.target_names + info.target_count);
    places_ = note_on_targets(info, surface);
    moved_.resize(info.point_count);
    for (const auto& [frame, timestamp_ms] : before_) rows_of(frame, timestamp_ms, false);
    before_.clear();
}

void PlanFollower::move(defrec_job job) {
    require(defrec_job_move_plan(job, plan_.get(), moved_.status.size(), moved_.xyz.data(),
                                 moved_.covariance.data(), moved_.status.data(),
                                 moved_.expected_error_mm.data()),
            ExitCode::kInternal, "moving the plan");
    moved_.project(projection_);
}

// The mean of the vertices is off by no more than the mean of their covariances, however much of
// their errors they share.
void PlanFollower::fill_part(std::size_t part, PlanRow& row) const {
    const std::vector<std::uint32_t>& vertices = part_vertices_[part];
    PositionRow sum, each;
    sum.status = PointStatus::kTracked;
    for (const std::uint32_t vertex : vertices) {
        if (!moved_.fill(vertex, each)) return;
        if (each.status == PointStatus::kExtrapolated) sum.status = each.status;
        for (std::size_t k = 0; k < 3; ++k) sum.xyz[k] += each.xyz[k];
        for (std::size_t k = 0; k < 6; ++k) sum.covariance[k] += each.covariance[k];
    }
    if (vertices.empty()) return;
    const auto count = static_cast<double>(vertices.size());
    for (double& value : sum.xyz) value /= count;
    for (double& value : sum.covariance) value /= count;
    projection_.project(sum.xyz, 1, sum.uv);
    row.status = sum.status;
    std::copy_n(sum.xyz, 3, row.xyz);
    std::copy_n(sum.uv, 2, row.uv);
    std::copy_n(sum.covariance, 6, row.covariance);
    row.expected_error_mm = std::sqrt(sum.covariance[0] + sum.covariance[3] + sum.covariance[5]);
}

std::vector<PlanRow> PlanFollower::rows_of(std::int64_t frame, double timestamp_ms,
                                           bool is_placed) {
    std::vector<PlanRow> rows(target_count_ + part_vertices_.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
        PlanRow& row = rows[i];
        const bool is_target = i < target_count_;
        row.frame = frame;
        row.timestamp_ms = timestamp_ms;
        row.id = static_cast<std::int64_t>(is_target ? i : i - target_count_);
        if (is_target && i < target_names_.size()) row.target = target_names_[i];
        if (!is_target) row.part = model_->parts[i - target_count_].name;
        if (is_placed && is_target) moved_.fill(vertex_count_ + i, row);
        if (is_placed && !is_target) fill_part(i - target_count_, row);
        if (!is_target)
            partly_known_.add(is_placed ? &moved_ : nullptr, part_vertices_[i - target_count_]);
        (is_target ? target_rows_ : part_rows_).add(row.status);
        file_.add(row);
    }
    return rows;
}

void PlanFollower::write_mesh(std::int64_t frame) {
    const std::vector<float> vertices(
        moved_.xyz.begin(), moved_.xyz.begin() + static_cast<std::ptrdiff_t>(3 * vertex_count_)),
        errors(moved_.expected_error_mm.begin(),
               moved_.expected_error_mm.begin() + static_cast<std::ptrdiff_t>(vertex_count_));
    write_ply(mesh_path(mesh_folder_, frame),
              {vertices.data(), nullptr, moved_.status.data(), errors.data(), vertex_count_,
               model_->triangles.data(), model_->triangles.size() / 3});
    ++mesh_count_;
}

PlanFrame PlanFollower::add_frame(std::int64_t frame, double timestamp_ms, defrec_job job) {
    if (!plan_) {
        before_.emplace_back(frame, timestamp_ms);
        return {};
    }
    const bool is_placed = job != nullptr && !is_forgotten_;
    if (is_placed) move(job);
    PlanFrame made{rows_of(frame, timestamp_ms, is_placed), is_placed ? &moved_ : nullptr};
    const bool is_due = options_.mesh_every > 0 && frame % options_.mesh_every == 0;
    if (is_placed && is_due && vertex_count_ > 0) write_mesh(frame);
    return made;
}

void fill_plan(const std::shared_ptr<const PlanModel>& model, const PlanFrame& frame,
               PlanEstimate& plan) {
    plan = {};
    plan.model = model;
    for (const PlanRow& row : frame.rows) {
        PointEstimate point = point_estimate(row);
        point.name = row.part.empty() ? row.target : row.part;
        (row.part.empty() ? plan.targets : plan.parts).push_back(std::move(point));
    }
    if (frame.points == nullptr) return;
    const MovedPoints& points = *frame.points;
    const std::size_t count = points.status.size() - plan.targets.size();
    plan.vertices.assign(points.xyz.begin(),
                         points.xyz.begin() + static_cast<std::ptrdiff_t>(3 * count));
    plan.expected_error_mm.assign(
        points.expected_error_mm.begin(),
        points.expected_error_mm.begin() + static_cast<std::ptrdiff_t>(count));
    for (std::size_t i = 0; i < count; ++i) plan.status.push_back(vertex_status(points.status[i]));
}

LinkPlan link_plan(const PlanModel& model, const PlanFrame& frame) {
    LinkPlan plan;
    if (frame.points == nullptr) return plan;
    for (const PlanRow& row : frame.rows)
        if (row.part.empty() && row.status != PointStatus::kLost) {
            plan.targets.push_back(link_point(row));
            plan.targets.back().name = row.target;
        }
    for (std::size_t place = 0; place < model.parts.size(); ++place) {
        LinkPart part = link_part(model, place, *frame.points);
        if (!part.triangles.empty()) plan.parts.push_back(std::move(part));
    }
    return plan;
}

}  // namespace defrec::cli
