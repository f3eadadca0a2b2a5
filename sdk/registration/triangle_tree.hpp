// The nearest point of a triangle mesh, by a tree of boxes.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace defrec {

class TriangleTree {
  public:
    struct Nearest {
        uint32_t triangle;
        Eigen::Vector3d place;
        double squared;  // distance, mm^2
    };

    // vertices: xyz each; triangles: three vertices each, every one with an area, at least one.
    TriangleTree(std::span<const float> vertices, std::span<const uint32_t> triangles);

    // The nearest point of the triangles that show their front to the viewer; viewer: null for all
    // triangles. guess: a triangle that is likely near, such as the last one. Empty where none
    // shows its front. Any thread.
    std::optional<Nearest> nearest(const Eigen::Vector3d& place, const Eigen::Vector3d* viewer,
                                   uint32_t guess) const;

    // Unit length, counter-clockwise.
    Eigen::Vector3d normal(uint32_t triangle) const {
        return faces_[triangle].normal.cast<double>();
    }

  private:
    struct Face {
        std::array<Eigen::Vector3f, 3> corner;
        Eigen::Vector3f normal;
    };
    struct Box {
        Eigen::Array3f low, high;
        void include(const Box& other) {
            low = low.min(other.low);
            high = high.max(other.high);
        }
        double squared_distance(const Eigen::Array3f& place) const;
    };
    // A leaf holds triangles order_[first .. first + count); otherwise its children are nodes first
    // and first + 1, and count is 0.
    struct Node {
        Box box;
        uint32_t first, count;
    };

    Box box_of(uint32_t triangle) const;
    void build(uint32_t node, uint32_t first, uint32_t last);
    void look_at(uint32_t triangle, const Eigen::Vector3d& place, const Eigen::Vector3d* viewer,
                 std::optional<Nearest>& best) const;

    std::vector<Face> faces_;
    std::vector<uint32_t> order_;
    std::vector<Node> nodes_;
};

}  // namespace defrec
