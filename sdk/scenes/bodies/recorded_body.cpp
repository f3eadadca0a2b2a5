// An elastic body whose displacement another program computed.
#include "sdk/scenes/bodies/recorded_body.hpp"

#include <algorithm>
#include <bit>

#include "sdk/scenes/bodies/cubic.hpp"

namespace defrec::cli {

RecordedBody::RecordedBody(RecordedWords words)
    : columns_(words[0]),
      rows_(words[1]),
      layers_(words[2]),
      loads_(words[3] + 1),
      first_s_(std::bit_cast<float>(words[4])),
      first_t_(std::bit_cast<float>(words[5])),
      spacing_s_(std::bit_cast<float>(words[6])),
      spacing_t_(std::bit_cast<float>(words[7])),
      quantum_(std::bit_cast<float>(words[8])) {
    quanta_.assign(3 * columns_ * rows_ * layers_, 0);
    for (const std::uint32_t word : words.subspan(9)) {
        quanta_.push_back(static_cast<std::int16_t>(word & 0xFFFFu));
        quanta_.push_back(static_cast<std::int16_t>(word >> 16u));
    }
}

Eigen::Vector3d RecordedBody::node(std::size_t load, std::size_t layer, std::size_t row,
                                   std::size_t column) const {
    const std::int16_t* q =
        &quanta_[3 * (((load * layers_ + layer) * rows_ + row) * columns_ + column)];
    return quantum_ * Eigen::Vector3d(q[0], q[1], q[2]);
}

Eigen::Vector3d RecordedBody::displacement(const BodyLoad& load, double s, double t,
                                           std::size_t layer) const {
    const double share = std::clamp(load.share, 0.0, 1.0);
    if (share == 0) {
        return Eigen::Vector3d::Zero();
    }
    const CubicNodes loads = cubic_nodes(share * static_cast<double>(loads_ - 1), loads_);
    const CubicNodes across = cubic_nodes((s - first_s_) / spacing_s_, columns_);
    const CubicNodes down = cubic_nodes((t - first_t_) / spacing_t_, rows_);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t l = 0; l < 4; ++l) {
        for (std::size_t j = 0; j < 4; ++j) {
            for (std::size_t i = 0; i < 4; ++i) {
                sum += loads.weights[l] * down.weights[j] * across.weights[i] *
                       node(loads.first + l, layer, down.first + j, across.first + i);
            }
        }
    }
    return sum;
}

}  // namespace defrec::cli
