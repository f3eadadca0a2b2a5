// What the live link sends of one frame: plain values, no library handle.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace defrec::cli {

// A followed point that is not lost.
struct LinkPoint {
    std::int64_t id = 0;
    const char* status = "";  // its name as in points.csv
    std::array<double, 3> xyz{};
    double expected_error_mm = 0;
    std::string name{};  // sent in place of the id; empty: none
};

// A target beneath the surface that is not lost.
struct LinkTarget : LinkPoint {
    std::array<float, 6> covariance{};  // xx, xy, xz, yy, yz, zz, mm^2
};

// The known part of a plan's part: triangles whose vertices are not unknown, and their vertices.
struct LinkPart {
    std::string name;
    std::size_t place = 0;                         // among the plan's parts
    std::vector<float> vertices;                   // xyz interleaved
    std::vector<float> expected_error_mm, status;  // one each; DEFREC_POINT_*
    std::vector<std::uint32_t> triangles;
};

// Parts and targets that are not lost; only with geometry.
struct LinkPlan {
    std::vector<LinkPart> parts;
    std::vector<LinkPoint> targets;
};

// The left view as the camera delivered it.
struct LinkImage {
    const std::uint8_t* pixels = nullptr;
    int width = 0, height = 0;
    int channels = 0;                   // 1: gray, 3: BGR
    std::size_t stride = 0;             // bytes from row to row
    std::shared_ptr<const void> owner;  // of the pixels
};

// All lengths in mm, all coordinates in the left rectified camera.
struct LinkFrame {
    std::int64_t index = 0;         // in the input
    std::int64_t timestamp_ns = 0;  // of the link's clock
    std::uint32_t state = 0, reasons = 0, epoch = 0;
    std::optional<LinkImage> image;  // where it was asked for
    // The rest stays empty where the frame has no geometry to be trusted.
    bool has_geometry = false;
    std::array<double, 12> rigid_motion{};  // from the template frame, rows of [R | t]
    std::vector<float> vertices;            // xyz interleaved
    std::vector<std::uint8_t> vertex_status, vertex_evidence;
    std::vector<float> expected_error_mm;
    std::vector<float> vertex_covariance;  // xx, xy, xz, yy, yz, zz each, mm^2
    std::shared_ptr<const std::vector<std::uint32_t>> triangles;  // three vertex indices each
    std::vector<LinkPoint> points;
    std::vector<LinkTarget> targets;
    std::optional<LinkPlan> plan;  // empty: none is followed, or no geometry
};

}  // namespace defrec::cli
