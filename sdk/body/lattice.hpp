// The cells that an elastic body is computed on: cubes, small near the surface that is seen, larger
// farther away (an octree), each with trilinear shape functions. A node on the edge or face of a
// larger cell hangs: it has the value that the larger cell has there, so that fields are
// continuous.
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <unordered_map>
#include <vector>

namespace defrec {

class Lattice {
  public:
    struct Cell {
        std::array<int32_t, 3> corner{};  // the lowest, in steps of the finest cells
        int32_t size = 1;                 // of an edge: 1, 2, 4 or 8 such steps
        float stiffness = 0;  // relative to the tissue's, less where the body fills a part
        std::array<int32_t, 8> node{};  // x fastest, then y, then z
    };
    // What a node's value is made of: values of free nodes with weights of sum 1.
    struct Term {
        int32_t node;
        double weight;
    };
    // Where a place lies in a cell, 0..1 along each axis.
    struct Place {
        int32_t cell = -1;
        Eigen::Vector3d at = Eigen::Vector3d::Zero();
        std::array<double, 8> weights() const;
    };

    // What a lattice is made for. All in mm.
    struct Request {
        double step = 0;            // edge of the finest cells
        Eigen::Vector3d low, high;  // box that the body lies in
        // Mean stiffness of the body in a cube with that centre and edge; 0 outside.
        std::function<double(const Eigen::Vector3d& centre, double edge)> stiffness;
        // About how far a place is from the surface that is seen.
        std::function<double(const Eigen::Vector3d& place)> distance;
        size_t max_cells = 0;
        std::function<bool()> is_wanted;  // asked now and then; false: the lattice stays empty
    };
    // Throws Error(DEFREC_ERROR_UNSUPPORTED) where max_cells do not do.
    explicit Lattice(const Request& request);

    double step() const { return step_; }
    std::span<const Cell> cells() const { return cells_; }
    // Where nodes are at rest, mm.
    std::span<const Eigen::Vector3d> nodes() const { return nodes_; }
    // Nodes that do not hang come first.
    size_t free_nodes() const { return free_; }
    std::span<const Term> terms(size_t node) const {
        return {terms_.data() + first_term_[node], first_term_[node + 1] - first_term_[node]};
    }
    double edge(const Cell& cell) const { return cell.size * step_; }

    // The cell at a place; none (cell -1) outside the body.
    Place find(const Eigen::Vector3d& place) const;
    // Where a place in a cell is, mm.
    Eigen::Vector3d position(const Place& place) const;
    // The cell at a place, or the place of the body nearest to it within about that distance.
    Place find_near(const Eigen::Vector3d& place, double reach) const;

  private:
    class Corners;
    using Corner = std::array<int32_t, 3>;
    static uint64_t key(const Corner& corner, int32_t size);
    int32_t cell_at(const Corner& fine) const;
    void divide(const Request& request, const Corner& corner, int32_t size);
    void number_nodes();
    void find_nearer(size_t cell, const Eigen::Vector3d& place, double& squared,
                     Place& nearest) const;

    double step_;
    Eigen::Vector3d low_;
    Corner count_{};
    std::vector<Cell> cells_;
    std::unordered_map<uint64_t, int32_t> cell_of_;
    // Cells of one cube of the largest size follow each other: from where on, per cube, x fastest.
    std::vector<size_t> block_begin_;
    std::vector<Eigen::Vector3d> nodes_;
    size_t free_ = 0;
    std::vector<size_t> first_term_;
    std::vector<Term> terms_;
};

}  // namespace defrec
