// See rendered_sequence.hpp.
#include "conformance/cases/sequence/rendered_sequence.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <mutex>
#include <thread>

#include "sdk/scenes/film.hpp"

namespace defrec::conformance {
namespace {

defrec_intrinsics intrinsics_of(const cli::Lens& lens) {
    defrec_intrinsics result{};
    result.fx = lens.fx;
    result.fy = lens.fy;
    result.cx = lens.cx;
    result.cy = lens.cy;
    std::copy(lens.distortion.begin(), lens.distortion.end(), result.distortion);
    result.distortion_count = static_cast<uint32_t>(lens.distortion.size());
    return result;
}

defrec_rig_desc rig_of(const cli::StereoRig& rig) {
    defrec_rig_desc desc;
    DEFREC_INIT(&desc);
    desc.width = static_cast<uint32_t>(rig.width);
    desc.height = static_cast<uint32_t>(rig.height);
    desc.left = intrinsics_of(rig.left);
    desc.right = intrinsics_of(rig.right);
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) desc.rotation[3 * i + j] = rig.rotation(i, j);
        desc.translation[i] = rig.translation[i];
    }
    return desc;
}

RenderedSequence shoot(const SequenceRequest& request) {
    constexpr uint64_t kSeed = 1;
    const int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    cli::Film film(request.scene, static_cast<int>(request.width), static_cast<int>(request.height),
                   static_cast<int>(request.frames), kSeed, threads);
    RenderedSequence result{request, rig_of(film.scene().rig), {}, {}};
    for (uint32_t i = 0; i < request.frames; ++i) {
        film.advance();
        FilmedFrame frame{film.left_bgr(), film.right_bgr(), {}, film.shows_tissue()};
        for (size_t point = 0; point < film.points().size(); ++point) {
            const cli::Film::Truth truth = film.truth(point);
            frame.truth.push_back(
                {{truth.position.x(), truth.position.y(), truth.position.z()}, truth.visible});
        }
        result.frames.push_back(std::move(frame));
    }
    for (const cli::Film::Followed& point : film.points())
        result.points.insert(result.points.end(), {point.u, point.v});
    return result;
}

}  // namespace

const RenderedSequence& rendered_sequence(const SequenceRequest& request) {
    static std::mutex mutex;
    static std::map<SequenceRequest, std::unique_ptr<const RenderedSequence>> known;
    const std::lock_guard lock(mutex);
    auto& kept = known[request];
    if (kept == nullptr) kept = std::make_unique<const RenderedSequence>(shoot(request));
    return *kept;
}

}  // namespace defrec::conformance
