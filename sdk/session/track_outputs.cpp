// What `defrec track` leaves in its folder besides overlay and report.
#include "sdk/session/track_outputs.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "include/defrec_c.h"
#include "sdk/io/output_folder.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {
namespace {

constexpr int kMillimetreDecimals = 4;
constexpr int kPixelDecimals = 3;
constexpr int kTimeDecimals = 3;
constexpr int kCovarianceDecimals = 6;
constexpr int kRigDecimals = 4;
static_assert(std::endian::native == std::endian::little,
              "PLY files are written as the memory lies");

void append_field(std::string& line, double value, int decimals) {
    line += ',';
    if (std::isfinite(value)) append_fixed(line, value, decimals);
}

void append_count(std::string& line, unsigned value) {
    line += ',';
    append_integer(line, value);
}

void begin_row(std::string& line, const PositionRow& row) {
    line.clear();
    append_integer(line, row.frame);
    append_field(line, row.timestamp_ms, kTimeDecimals);
    line += ',';
    append_integer(line, row.id);
}

// Without what would end a field: no file has quoting.
std::string as_field(std::string text) {
    for (char& c : text)
        if (c == ',' || c == '"' || c == '\r' || c == '\n') c = '_';
    return text;
}

constexpr char kPositionColumns[] = "x,y,z,u,v,status,expected_error_mm,xx,xy,xz,yy,yz,zz";

void append_position(std::string& line, const PositionRow& row) {
    if (row.status == PointStatus::kLost) {
        line += ",,,,,,lost,,,,,,,";
        return;
    }
    for (const double coordinate : row.xyz) append_field(line, coordinate, kMillimetreDecimals);
    for (const double coordinate : row.uv) append_field(line, coordinate, kPixelDecimals);
    line += ',';
    line += name_of(row.status);
    append_field(line, row.expected_error_mm, kMillimetreDecimals);
    for (const double element : row.covariance) append_field(line, element, kCovarianceDecimals);
}

template <typename T>
void append_bytes(std::string& out, const T* values, std::size_t count) {
    out.append(reinterpret_cast<const char*>(values), count * sizeof(T));
}

}  // namespace

const char* name_of(PointStatus status) {
    switch (status) {
        case PointStatus::kTracked:
            return "tracked";
        case PointStatus::kExtrapolated:
            return "extrapolated";
        case PointStatus::kLost:
            break;
    }
    return "lost";
}

const char* evidence_name(std::uint32_t evidence) {
    const bool has_depth = (evidence & DEFREC_EVIDENCE_DEPTH) != 0,
               is_photometric = (evidence & DEFREC_EVIDENCE_PHOTOMETRIC) != 0;
    if (has_depth) return is_photometric ? "both" : "depth";
    return is_photometric ? "photometric" : "none";
}

PointsFile::PointsFile(const std::filesystem::path& path) : file_(path) {
    file_.write(std::string("frame,timestamp_ms,id,") + kPositionColumns + ",evidence,piece\n");
}

void PointsFile::add(const PointRow& row) {
    begin_row(line_, row);
    append_position(line_, row);
    if (row.status == PointStatus::kLost) {
        line_ += ",,";
    } else {
        line_.append(",").append(evidence_name(row.evidence)).append(",");
        append_integer(line_, row.piece);
    }
    file_.write(line_ += '\n');
}

void PointsFile::commit() { file_.commit(); }

TargetsFile::TargetsFile(const std::filesystem::path& path) : file_(path) {
    file_.write(std::string("frame,timestamp_ms,id,depth,") + kPositionColumns + "\n");
}

void TargetsFile::add(const TargetRow& row) {
    begin_row(line_, row);
    append_field(line_, row.depth.value_or(NAN), kMillimetreDecimals);
    append_position(line_, row);
    file_.write(line_ += '\n');
}

void TargetsFile::commit() { file_.commit(); }

PlanFile::PlanFile(const std::filesystem::path& path) : file_(path) {
    file_.write(std::string("frame,timestamp_ms,id,part,target,") + kPositionColumns + "\n");
}

void PlanFile::add(const PlanRow& row) {
    line_.clear();
    append_integer(line_, row.frame);
    append_field(line_, row.timestamp_ms, kTimeDecimals);
    line_ += ',';
    if (row.part.empty()) append_integer(line_, row.id);
    line_.append(",").append(as_field(row.part)).append(",").append(as_field(row.target));
    append_position(line_, row);
    file_.write(line_ += '\n');
}

void PlanFile::commit() { file_.commit(); }

DisplayFile::DisplayFile(const std::filesystem::path& path) : file_(path) {
    file_.write(std::string("frame,timestamp_ms,display_ms,kind,id,part,target,") +
                kPositionColumns + ",basis\n");
}

void DisplayFile::add(const DisplayRow& row) {
    line_.clear();
    append_integer(line_, row.frame);
    append_field(line_, row.timestamp_ms, kTimeDecimals);
    append_field(line_, row.display_ms, kTimeDecimals);
    line_.append(",").append(row.kind).append(",");
    append_integer(line_, row.id);
    line_.append(",").append(as_field(row.part)).append(",").append(as_field(row.target));
    append_position(line_, row);
    line_ += ',';
    if (row.status != PointStatus::kLost) line_ += row.basis;
    file_.write(line_ += '\n');
}

void DisplayFile::commit() { file_.commit(); }

void write_frames(const std::filesystem::path& path, const FrameLog& frames) {
    AtomicFile file(path);
    std::string line =
        "frame,timestamp_ms,state,reasons,faulty_views,epoch,age,features,matches,inliers,patches,"
        "observed_share,mean_residual_mm,view_lag_frames,vertical_offset_px,roll_deg,focal_ratio,"
        "rig_matches,frame_ms";
    for (const FrameLog::Stage& stage : frames.stages()) {
        std::string column = stage.name;
        std::replace(column.begin(), column.end(), ' ', '_');
        line.append(",").append(column).append("_ms");
    }
    file.write(line += '\n');
    for (std::size_t i = 0; i < frames.rows().size(); ++i) {
        const FrameLog::Row& row = frames.rows()[i];
        line.clear();
        append_integer(line, row.frame);
        append_field(line, row.timestamp_ms, kTimeDecimals);
        for (const std::string* text : {row.state, row.reasons, row.faulty_views})
            line.append(",").append(*text);
        for (const unsigned count :
             {row.epoch, row.age, row.features, row.matches, row.inliers, row.patches}) {
            append_count(line, count);
        }
        append_field(line, row.observed_share, kMillimetreDecimals);
        append_field(line, row.mean_residual_mm, kMillimetreDecimals);
        for (const double value :
             {row.view_lag_frames, row.vertical_offset_px, row.roll_deg, row.focal_ratio}) {
            append_field(line, value, kRigDecimals);
        }
        append_count(line, row.rig_matches);
        append_field(line, row.frame_ms, kTimeDecimals);
        for (const FrameLog::Stage& stage : frames.stages())
            append_field(line, double{stage.ms[i]}, kTimeDecimals);
        file.write(line += '\n');
    }
    file.commit();
}

void write_ply(const std::filesystem::path& path, const MeshView& mesh) {
    std::string header =
        "ply\nformat binary_little_endian 1.0\ncomment millimetres, left rectified camera\nelement "
        "vertex ";
    append_integer(header, static_cast<std::int64_t>(mesh.vertex_count));
    header += "\nproperty float x\nproperty float y\nproperty float z\n";
    if (mesh.normals != nullptr)
        header += "property float nx\nproperty float ny\nproperty float nz\n";
    if (mesh.status != nullptr) header += "property uchar status\n";
    if (mesh.expected_error_mm != nullptr) header += "property float expected_error_mm\n";
    header += "element face ";
    append_integer(header, static_cast<std::int64_t>(mesh.triangle_count));
    header += "\nproperty list uchar uint vertex_indices\nend_header\n";

    std::string body;
    for (std::size_t i = 0; i < mesh.vertex_count; ++i) {
        append_bytes(body, mesh.vertices + 3 * i, 3);
        if (mesh.normals != nullptr) append_bytes(body, mesh.normals + 3 * i, 3);
        if (mesh.status != nullptr) append_bytes(body, mesh.status + i, 1);
        if (mesh.expected_error_mm != nullptr) append_bytes(body, mesh.expected_error_mm + i, 1);
    }
    constexpr char kCorners = 3;
    for (std::size_t i = 0; i < mesh.triangle_count; ++i) {
        body += kCorners;
        append_bytes(body, mesh.triangles + 3 * i, 3);
    }
    AtomicFile file(path);
    file.write(header);
    file.write(body);
    file.commit();
}

// A longer run's would pass for meshes of this one.
void empty_mesh_folder(const std::filesystem::path& folder) {
    create_output_folder(folder);
    std::error_code ignored;
    for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
        const std::string stem = entry.path().stem().string();
        const bool is_number = stem.find_first_not_of("0123456789") == std::string::npos;
        if (is_number && entry.path().extension() == ".ply")
            std::filesystem::remove(entry.path(), ignored);
    }
}

std::filesystem::path mesh_path(const std::filesystem::path& folder, std::int64_t frame) {
    std::array<char, 32> name{};
    std::snprintf(name.data(), name.size(), "%06lld.ply", static_cast<long long>(frame));
    return folder / name.data();
}

}  // namespace defrec::cli
