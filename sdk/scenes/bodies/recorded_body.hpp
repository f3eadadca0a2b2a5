// An elastic body whose displacement another program computed: layers of a regular grid, for
// growing loads, interpolated smoothly. scripts/bodies/make_bodies.py writes them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sdk/scenes/bodies/elastic_body.hpp"

namespace defrec::cli {

/// A file of bodies/recorded in little-endian words: columns, rows, layers, loads (int32), the
/// first s and t, their spacings, the quantum (float32, mm), and displacements in quanta (int16) by
/// load, layer, row, column and axis. The first layers of kBodyDepths, the last load is the
/// largest; load 0 is not there, it displaces nothing.
using RecordedWords = std::span<const std::uint32_t>;

namespace recorded {
extern const RecordedWords organ_030, organ_049;
extern const RecordedWords inclusion_030, inclusion_049;
extern const RecordedWords retract_030, retract_049;
}  // namespace recorded

class RecordedBody : public ElasticBody {
  public:
    explicit RecordedBody(RecordedWords words);

    std::size_t layers() const { return layers_; }
    /// Cubic in s, t and the share of the load, with continuous slopes; straight on beyond the
    /// grid.
    Eigen::Vector3d displacement(const BodyLoad& load, double s, double t,
                                 std::size_t layer) const override;

  private:
    Eigen::Vector3d node(std::size_t load, std::size_t layer, std::size_t row,
                         std::size_t column) const;

    std::size_t columns_, rows_, layers_, loads_;  ///< loads_: load 0 included
    double first_s_, first_t_, spacing_s_, spacing_t_, quantum_;
    std::vector<std::int16_t> quanta_;
};

}  // namespace defrec::cli
