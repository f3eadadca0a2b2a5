// What `defrec track` leaves in its folder besides overlay and report: points.csv, targets.csv,
// plan.csv, display.csv, frames.csv, PLY meshes. The same results give the same bytes in these but
// for frames.csv; times stand only there and in summary.json.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/session/frame_log.hpp"

namespace defrec::cli {

enum class PointStatus { kTracked, kExtrapolated, kLost };
const char* name_of(PointStatus status);
// "both", "depth", "photometric" or "none".
const char* evidence_name(std::uint32_t evidence);

// Where a followed point is in a frame.
struct PositionRow {
    std::int64_t frame = 0;
    double timestamp_ms = 0;
    std::int64_t id = 0;
    PointStatus status = PointStatus::kLost;
    // Only points that are not lost have these.
    double xyz[3] = {};  // mm, left rectified camera of this frame
    double uv[2] = {};   // pixels of the left image as given
    double expected_error_mm = 0;
    double covariance[6] = {};  // xx, xy, xz, yy, yz, zz, mm^2
};

struct PointRow : PositionRow {
    std::uint32_t evidence = 0;  // DEFREC_EVIDENCE_*
    std::uint32_t piece = 0;     // of the surface, that it lies on
    std::string name{};          // not written
    bool is_chosen = false;      // by the user, and followed since this frame or an earlier one
};

struct TargetRow : PositionRow {
    std::optional<double> depth;  // mm beneath the surface, as given
};

// A target of a plan, whose id is its place in the plan from 0, or the middle of a part.
struct PlanRow : PositionRow {
    std::string part;    // its name, and the id is its place among the parts; empty: of a target
    std::string target;  // name of a target; empty: it has none, or of a part
};

// A point, target or part that is followed, at the time of display.
struct DisplayRow : PositionRow {
    double display_ms = 0;         // the time
    std::string kind{};            // "point", "target", "plan-target" or "plan-part"
    std::string part{}, target{};  // its name
    std::string basis{};           // what the prediction rests on: "last", "velocity" or "learned"
};

// points.csv: frame,timestamp_ms,id,x,y,z,u,v,status,expected_error_mm,xx,xy,xz,yy,yz,zz,evidence,
// piece. What is unknown of a lost point stays empty.
class PointsFile {
  public:
    explicit PointsFile(const std::filesystem::path& path);
    void add(const PointRow& row);
    void commit();

  private:
    AtomicFile file_;
    std::string line_;
};

inline constexpr char kPointsFile[] = "points.csv";
inline constexpr char kTargetsFile[] = "targets.csv";
inline constexpr char kPlanFile[] = "plan.csv";
inline constexpr char kDisplayFile[] = "display.csv";
inline constexpr char kFramesFile[] = "frames.csv";
inline constexpr char kTemplateFile[] = "template.ply";
inline constexpr char kSummaryFile[] = "summary.json";
// Folders of meshes, one of each frame.
inline constexpr char kMeshFolder[] = "deformed";
inline constexpr char kPlanFolder[] = "plan";

// frame,timestamp_ms,id,depth,x,y,z,u,v,status,expected_error_mm,xx,xy,xz,yy,yz,zz. What is unknown
// of a lost target stays empty, and a depth that was not given.
class TargetsFile {
  public:
    explicit TargetsFile(const std::filesystem::path& path);
    void add(const TargetRow& row);
    void commit();

  private:
    AtomicFile file_;
    std::string line_;
};

// frame,timestamp_ms,id,part,target,x,y,z,u,v,status,expected_error_mm,xx,xy,xz,yy,yz,zz; rows of
// parts have no id, rows of targets no part. What is unknown of a lost one stays empty. In names
// _ stands for commas, quotes and line ends.
class PlanFile {
  public:
    explicit PlanFile(const std::filesystem::path& path);
    void add(const PlanRow& row);
    void commit();

  private:
    AtomicFile file_;
    std::string line_;
};

// frame,timestamp_ms,display_ms,kind,id,part,target,x,y,z,u,v,status,expected_error_mm,xx,xy,xz,yy,
// yz,zz,basis. Names as in PlanFile; what is unknown of a lost one stays empty.
class DisplayFile {
  public:
    explicit DisplayFile(const std::filesystem::path& path);
    void add(const DisplayRow& row);
    void commit();

  private:
    AtomicFile file_;
    std::string line_;
};

// frames.csv:
// frame,timestamp_ms,state,reasons,faulty_views,epoch,age,features,matches,inliers,patches,
// observed_share,mean_residual_mm,view_lag_frames,vertical_offset_px,roll_deg,focal_ratio,
// rig_matches,frame_ms and a column <stage>_ms for each stage, blanks in its name turned into _.
void write_frames(const std::filesystem::path& path, const FrameLog& frames);

// Borrowed; xyz interleaved, mm. normals, status and errors may be null.
struct MeshView {
    const float* vertices = nullptr;
    const float* normals = nullptr;
    const std::uint8_t* status = nullptr;  // DEFREC_POINT_*
    const float* expected_error_mm = nullptr;
    std::size_t vertex_count = 0;
    const std::uint32_t* triangles = nullptr;  // three vertex indices each
    std::size_t triangle_count = 0;
};

// Binary little-endian PLY: vertex x y z [nx ny nz] [status expected_error_mm], face
// vertex_indices.
void write_ply(const std::filesystem::path& path, const MeshView& mesh);

// A folder of meshes that are named by their frames; what an earlier run left there is removed.
// Throws CliError(kOutput).
void empty_mesh_folder(const std::filesystem::path& folder);
// 000123.ply of the folder.
std::filesystem::path mesh_path(const std::filesystem::path& folder, std::int64_t frame);

}  // namespace defrec::cli
