// A template as a file: a header with the layout's number, the arrays of the first view one after
// the other, the pieces of its control points, the parts that joined, cuts, the body if the
// application described one, a checksum. Little endian.
#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <utility>

#include "sdk/base/os/binary_file.hpp"
#include "sdk/body/body_slot.hpp"
#include "sdk/contract/descs.hpp"
#include "sdk/device/context.hpp"
#include "sdk/template/atlas.hpp"
#include "sdk/template/check_patches.hpp"
#include "sdk/template/decisions.hpp"
#include "sdk/template/template.hpp"
#include "sdk/template/texture_level.hpp"

namespace defrec {
namespace {

constexpr BinaryFileKind kTemplateFile = {
    "template", {'d', 'e', 'f', 'r', 'e', 'c', 'T', '\n'}, 2, uint64_t{1} << 30};

// Calls visit for every member, in the file's order; the same for reading and writing.
template <class Data, class Visit>
void visit_scalars(Data& data, Visit&& visit) {
    visit(data.width);
    visit(data.height);
    visit(data.camera);
    visit(data.grid.columns);
    visit(data.grid.rows);
    visit(data.grid.spacing);
    visit(data.node_grid.columns);
    visit(data.node_grid.rows);
    visit(data.node_grid.spacing_u);
    visit(data.node_grid.spacing_v);
    visit(data.node_spacing_mm);
    visit(data.disparity_sigma_px);
}
template <class Data, class Visit>
void visit_arrays(Data& data, Visit&& visit) {
    visit(data.grid.disparity);
    visit(data.grid.support);
    visit(data.grid.vertex);
    visit(data.node_grid.node);
    visit(data.vertices);
    visit(data.vertex_support);
    visit(data.triangles);
    visit(data.nodes);
    visit(data.edges);
    visit(data.landmarks);
    visit(data.landmark_points);
    visit(data.patches);
    visit(data.image);
}

template <class Part, class Visit>
void visit_part_scalars(Part& part, Visit&& visit) {
    visit(part.columns);
    visit(part.rows);
    visit(part.step_mm);
    visit(part.min_disparity);
    visit(part.max_disparity);
    visit(part.before);
}

// Checks of the first view are made anew when a file is read, so those of parts are counted from
// there.
void write_parts(const TemplateData& data, BinaryWriter& writer) {
    writer.value(data.atlas_end);
    writer.value(static_cast<uint64_t>(data.parts.size()));
    for (const SurfacePatch& part : data.parts) {
        visit_part_scalars(part, [&](const auto& value) { writer.value(value); });
        writer.array(part.vertex);
    }
    const TemplateCounts first = data.first_counts();
    writer.array(std::vector(data.checks.begin() + static_cast<std::ptrdiff_t>(first.checks),
                             data.checks.end()));
    std::vector<int32_t> check_of_vertex;
    for (const int32_t check : data.check_of_vertex)
        check_of_vertex.push_back(std::max(-1, check - static_cast<int32_t>(first.checks)));
    writer.array(check_of_vertex);
}

struct GrownChecks {
    std::vector<defrec_patch> checks;
    std::vector<int32_t> of_vertex;  // -1: it has one of the first view, or none
};

void read_parts(BinaryReader& reader, TemplateData& data, GrownChecks& grown) {
    constexpr uint64_t kMaxParts = 1 << 20;
    uint64_t parts = 0;
    reader.value(data.atlas_end);
    reader.value(parts);
    if (parts > kMaxParts) reader.broken("its number of parts is out of range");
    for (uint64_t i = 0; i < parts; ++i) {
        SurfacePatch& part = data.parts.emplace_back();
        visit_part_scalars(part, [&](auto& value) { reader.value(value); });
        reader.array(part.vertex);
    }
    reader.array(grown.checks);
    reader.array(grown.of_vertex);
}

void write_cuts(const std::vector<CutLine>& cuts, BinaryWriter& writer) {
    writer.value(static_cast<uint64_t>(cuts.size()));
    for (const CutLine& cut : cuts) {
        writer.value(cut.piece);
        writer.array(cut.pixels);
    }
}

void read_cuts(BinaryReader& reader, std::vector<CutLine>& cuts) {
    constexpr uint64_t kMaxCuts = 1 << 20;
    uint64_t count = 0;
    reader.value(count);
    if (count > kMaxCuts) reader.broken("its number of cuts is out of range");
    for (uint64_t i = 0; i < count; ++i) {
        CutLine& cut = cuts.emplace_back();
        reader.value(cut.piece);
        reader.array(cut.pixels);
        const auto is_inside = [](const std::array<float, 2>& pixel) {
            constexpr float kMost = 2 * DEFREC_MAX_SIDE;  // a cut may end outside of the image
            return std::abs(pixel[0]) <= kMost && std::abs(pixel[1]) <= kMost;  // false for NaN
        };
        if (cut.pixels.size() < 2 || !std::ranges::all_of(cut.pixels, is_inside))
            reader.broken("a cut is out of range");
    }
}

void write_mesh(const ClosedMesh& mesh, BinaryWriter& writer) {
    writer.array(mesh.vertices());
    writer.array(mesh.triangles());
}

ClosedMesh read_mesh(BinaryReader& reader) {
    std::vector<float> vertices;
    std::vector<uint32_t> triangles;
    reader.array(vertices);
    reader.array(triangles);
    if (vertices.size() % 3 != 0 || triangles.size() % 3 != 0)
        reader.broken("a mesh of its body is out of range");
    try {
        return {{vertices.data(), vertices.size() / 3, triangles.data(), triangles.size() / 3},
                "mesh"};
    } catch (const Error& error) {
        reader.broken(error.what());
    }
}

void write_body(const BodyDescription& body, BinaryWriter& writer) {
    writer.value(body.poisson_ratio);
    writer.value(body.cut_depth_mm);
    writer.value(static_cast<uint8_t>(body.mesh.has_value()));
    if (body.mesh) write_mesh(*body.mesh, writer);
    writer.value(static_cast<uint64_t>(body.regions.size()));
    for (const BodyDescription::Region& region : body.regions) {
        writer.value(region.stiffness);
        writer.value(static_cast<uint8_t>(region.is_held));
        write_mesh(region.mesh, writer);
    }
}

std::shared_ptr<const BodyDescription> read_body(BinaryReader& reader) {
    const auto is_within = [&](double value, double low, double high) {
        if (!(value >= low && value <= high)) reader.broken("a number of its body is out of range");
    };
    auto body = std::make_shared<BodyDescription>();
    reader.value(body->poisson_ratio);
    reader.value(body->cut_depth_mm);
    is_within(body->poisson_ratio, 0.0099, 0.4951);
    is_within(body->cut_depth_mm, 0.09, 1000);
    if (reader.flag()) body->mesh.emplace(read_mesh(reader));
    uint64_t regions = 0;
    reader.value(regions);
    is_within(static_cast<double>(regions), 0, kBodyMaxRegionCount);
    for (uint64_t i = 0; i < regions; ++i) {
        double stiffness = 0;
        reader.value(stiffness);
        is_within(stiffness, 0.009, 1000);
        const bool is_held = reader.flag();
        body->regions.push_back({read_mesh(reader), stiffness, is_held});
    }
    return body;
}

bool blend_weights_in_range(const int32_t* node, const float* weight, size_t nodes) {
    for (int k = 0; k < DEFREC_BLEND_NODES; ++k)
        if (node[k] < 0 || static_cast<size_t>(node[k]) >= nodes || !std::isfinite(weight[k]))
            return false;
    return true;
}

bool all_finite(const float* values, size_t count) {
    for (size_t i = 0; i < count; ++i)
        if (!std::isfinite(values[i])) return false;
    return true;
}
bool all_finite(const std::vector<float>& values) {
    return all_finite(values.data(), values.size());
}

bool patch_in_range(const TemplateData& data, const defrec_patch& patch) {
    return patch.view >= 0 && static_cast<size_t>(patch.view) < data.views() &&
           blend_weights_in_range(patch.node, patch.weight, data.nodes.size() / 3) &&
           all_finite(patch.position, 3) && all_finite(patch.tangent_u, 3) &&
           all_finite(patch.tangent_v, 3) && all_finite(&patch.u, 1) && all_finite(&patch.v, 1);
}

bool above_zero(double value) { return value > 0 && std::isfinite(value); }
// px, with the camera's offset, so that depth is behind the camera from 0 on down; the surface goes
// on beyond what was measured, also to less than the offset. Stage stereo measures none above the
// width beside the offset, an application may give up to 2000 px.
bool disparity_ok(const TemplateData& data, float value) {
    const auto offset = static_cast<float>(data.camera.disparity_offset_px);
    constexpr auto kMostGiven =
        static_cast<float>(2000 * decisions::TemplateSurface::kMaxDisparity);
    const auto width = static_cast<float>(data.width);
    const float most = data.disparity_sigma_px > 0 ? std::max(width, kMostGiven) : width;
    return value > 0 && value <= most + offset;
}

const char* fault_of_images(const TemplateData& data) {
    const auto side_ok = [](uint32_t side) { return side > 0 && side <= DEFREC_MAX_SIDE; };
    if (!side_ok(data.width) || !side_ok(data.height)) return "its image size is out of range";
    if (data.views() == 0 || data.views() > decisions::AtlasLimits::kMaxViews ||
        data.image.size() != data.views() * data.width * data.height ||
        (data.parts.empty() && data.views() != 1))
        return "its image has another size than it says";
    const defrec_camera& camera = data.camera;
    if (!above_zero(camera.fx) || !above_zero(camera.fy) || !above_zero(camera.baseline_mm) ||
        !std::isfinite(camera.cx) || !std::isfinite(camera.cy) ||
        !std::isfinite(camera.disparity_offset_px))
        return "its camera is impossible";
    if (!(data.disparity_sigma_px >= 0 &&
          data.disparity_sigma_px <= decisions::TemplateSurface::kMaxSigma))
        return "the standard deviation of its disparity is out of range";
    return nullptr;
}

// 0: no grid.
size_t cell_count(int columns, int rows) {
    return columns >= 2 && rows >= 2 && columns <= DEFREC_MAX_SIDE && rows <= DEFREC_MAX_SIDE
               ? static_cast<size_t>(columns) * static_cast<size_t>(rows)
               : 0;
}

const char* fault_of_grids(const TemplateData& data) {
    const SurfaceGrid& grid = data.grid;
    const size_t cells = cell_count(grid.columns, grid.rows);
    if (cells == 0 || grid.disparity.size() != cells || grid.support.size() != cells ||
        grid.vertex.size() != cells || !above_zero(grid.spacing) || !all_finite(grid.disparity) ||
        !all_finite(grid.support))
        return "its surface grid is inconsistent";
    const size_t node_cells = cell_count(data.node_grid.columns, data.node_grid.rows);
    if (node_cells == 0 || data.node_grid.node.empty() ||
        data.node_grid.node.size() % node_cells != 0 ||
        data.node_grid.node.size() / node_cells != data.pieces() ||
        !above_zero(data.node_grid.spacing_u) || !above_zero(data.node_grid.spacing_v))
        return "its grid of control points is inconsistent";
    return nullptr;
}

const char* fault_of_counts(const TemplateData& data) {
    const size_t nodes = data.nodes.size() / 3, vertices = data.vertices.size();
    if (nodes == 0 || data.nodes.size() % 3 != 0 || !all_finite(data.nodes))
        return "its control points are unusable";
    if (!data.node_piece.empty() &&
        (data.node_piece.size() != nodes || data.pieces() > decisions::TemplatePieces::kMaxPieces))
        return "the pieces of its control points are out of range";
    if (vertices == 0 || data.vertex_support.size() != vertices || data.triangles.size() % 3 != 0 ||
        !all_finite(data.vertex_support))
        return "its surface is empty or inconsistent";
    if (data.landmark_points.size() != data.landmarks.size())
        return "its landmarks are inconsistent";
    if (!above_zero(data.node_spacing_mm)) return "its control points have no spacing";
    return nullptr;
}

// Grids and counts are right by now, here and below.
const char* fault_of_grid_values(const TemplateData& data) {
    const size_t nodes = data.nodes.size() / 3, vertices = data.vertices.size();
    for (const int32_t vertex : data.grid.vertex)
        if (vertex < -1 || (vertex >= 0 && static_cast<size_t>(vertex) >= vertices))
            return "a vertex index is out of range";
    for (size_t i = 0; i < data.grid.vertex.size(); ++i)
        if (data.grid.vertex[i] >= 0 && !disparity_ok(data, data.grid.disparity[i]))
            return "a disparity of its surface is out of range";
    for (const int32_t node : data.node_grid.node)
        if (node < -1 || (node >= 0 && static_cast<size_t>(node) >= nodes))
            return "a control point index is out of range";
    return nullptr;
}

const char* fault_of_elements(const TemplateData& data) {
    const size_t nodes = data.nodes.size() / 3;
    const size_t node_cells = cell_count(data.node_grid.columns, data.node_grid.rows);
    for (const uint32_t index : data.triangles)
        if (index >= data.vertices.size()) return "a triangle's index is out of range";
    for (size_t i = 0; i < data.node_grid.node.size(); ++i)
        if (const int32_t node = data.node_grid.node[i];
            node >= 0 && data.piece_of_node(static_cast<size_t>(node)) != i / node_cells)
            return "a control point is on the grid of another piece";
    for (const defrec_edge& edge : data.edges)
        if (edge.a < 0 || edge.a >= edge.b || static_cast<size_t>(edge.b) >= nodes ||
            !above_zero(edge.weight))
            return "a connection is out of range";
    for (const defrec_landmark& landmark : data.landmarks)
        if (!all_finite(landmark.position, 3)) return "a landmark is out of range";
    for (const auto* points : {&data.vertices, &data.landmark_points})
        for (const defrec_surface_point& point : *points)
            if (!blend_weights_in_range(point.node, point.weight, nodes) ||
                !all_finite(point.position, 3) || !all_finite(point.normal, 3))
                return "a surface point is out of range";
    for (const defrec_patch& patch : data.patches)
        if (!patch_in_range(data, patch)) return "a patch is out of range";
    return nullptr;
}

// A file that was made by hand or by another version must not lead out of an array.
const char* fault_of(const TemplateData& data) {
    for (const auto part_fault : {fault_of_images, fault_of_grids, fault_of_counts,
                                  fault_of_grid_values, fault_of_elements})
        if (const char* fault = part_fault(data)) return fault;
    return nullptr;
}

bool increasing(const TemplateCounts& a, const TemplateCounts& b) {
    return a.vertices <= b.vertices && a.triangles <= b.triangles && a.nodes <= b.nodes &&
           a.edges <= b.edges && a.landmarks <= b.landmarks && a.patches <= b.patches &&
           a.checks <= b.checks;
}

// Likewise, of the parts.
const char* fault_of_parts(const TemplateData& data, const GrownChecks& grown) {
    const TemplateCounts first = data.first_counts();
    TemplateCounts end = data.counts();
    end.checks = first.checks + grown.checks.size();
    for (auto part = data.parts.rbegin(); part != data.parts.rend(); ++part) {
        if (!increasing(part->before, end)) return "a part's counts are out of range";
        if (part->columns < 1 || part->rows < 1 || part->columns > DEFREC_MAX_SIDE ||
            part->rows > DEFREC_MAX_SIDE ||
            part->vertex.size() !=
                static_cast<size_t>(part->columns) * static_cast<size_t>(part->rows) ||
            !above_zero(part->step_mm) || !disparity_ok(data, part->min_disparity) ||
            !disparity_ok(data, part->max_disparity))
            return "a part's grid is inconsistent";
        for (const int32_t vertex : part->vertex)
            if (vertex < -1 || vertex >= static_cast<int64_t>(end.vertices))
                return "a part's vertex is out of range";
        end = part->before;
    }
    if (data.atlas_end.x > data.width || data.atlas_end.y > data.height ||
        data.atlas_end.shelf > data.height)
        return "the end of its last atlas image is out of range";
    if (grown.of_vertex.size() != data.vertices.size()) return "its checks are inconsistent";
    for (const int32_t check : grown.of_vertex)
        if (check < -1 || check >= static_cast<int64_t>(grown.checks.size()))
            return "a check's index is out of range";
    for (const defrec_patch& check : grown.checks)
        if (!patch_in_range(data, check)) return "a check is out of range";
    return nullptr;
}

// The first view's pieces, from what moves its vertices.
void restore_grid_pieces(TemplateData& data) {
    if (data.node_piece.empty()) return;
    data.grid.piece.assign(data.grid.vertex.size(), 0);
    for (size_t i = 0; i < data.grid.vertex.size(); ++i)
        if (const int32_t vertex = data.grid.vertex[i]; vertex >= 0)
            data.grid.piece[i] = data.piece_of(data.vertices[static_cast<size_t>(vertex)]);
}

// With the first view's checks made anew the parts' follow them.
void append_checks(TemplateData& data, const GrownChecks& grown) {
    const auto moved =
        static_cast<int64_t>(data.checks.size()) - static_cast<int64_t>(data.first_counts().checks);
    for (SurfacePatch& part : data.parts)
        part.before.checks =
            static_cast<uint64_t>(static_cast<int64_t>(part.before.checks) + moved);
    const auto first = static_cast<int32_t>(data.checks.size());
    data.checks.insert(data.checks.end(), grown.checks.begin(), grown.checks.end());
    for (size_t i = 0; i < grown.of_vertex.size(); ++i)
        if (grown.of_vertex[i] >= 0) data.check_of_vertex[i] = first + grown.of_vertex[i];
}

}  // namespace

void Template::save(const char* path) const {
    BinaryWriter writer(kTemplateFile);
    visit_scalars(data_, [&](const auto& value) { writer.value(value); });
    visit_arrays(data_, [&](const auto& values) { writer.array(values); });
    writer.array(data_.node_piece);
    write_parts(data_, writer);
    write_cuts(data_.node_grid.cuts, writer);
    const std::shared_ptr<const BodyDescription> body = body_->description();
    writer.value(static_cast<uint8_t>(body != nullptr));
    if (body != nullptr) write_body(*body, writer);
    writer.save(path);
}

std::shared_ptr<const Template> Template::load(Context& context, const char* path) {
    BinaryReader reader(kTemplateFile, path);
    TemplateData data;
    visit_scalars(data, [&](auto& value) { reader.value(value); });
    visit_arrays(data, [&](auto& values) { reader.array(values); });
    GrownChecks grown;
    reader.array(data.node_piece);
    read_parts(reader, data, grown);
    read_cuts(reader, data.node_grid.cuts);
    std::shared_ptr<const BodyDescription> body;
    if (reader.flag()) body = read_body(reader);
    reader.expect_end();
    if (const char* fault = fault_of(data)) reader.broken(fault);
    if (const char* fault = fault_of_parts(data, grown)) reader.broken(fault);
    restore_grid_pieces(data);
    data.texture_level = texture_level(data.image.data(), data.width, data.height);
    place_checks(data);
    append_checks(data, grown);
    context.log(DEFREC_LOG_INFO, concat("template with ", data.vertices.size(),
                                        " vertices loaded from ", reader.path()));
    auto surface = std::make_shared<const Template>(std::move(data), context.allocator());
    surface->body_->recall(std::move(body));
    return surface;
}

}  // namespace defrec
