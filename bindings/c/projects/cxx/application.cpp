// Tracks a plane that faces the camera, on the CPU device.
#include <defrec_c.h>

#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

namespace {

constexpr uint32_t kWidth = 320, kHeight = 240, kDisparity = 20;
constexpr double kFocalLength = 300, kBaseline = 5;

int fail(const char* what) {
    std::fprintf(stderr, "%s: %s\n", what, defrec_last_error());
    return 1;
}

defrec_image gray(const std::vector<uint8_t>& pixels) {
    defrec_image image;
    DEFREC_INIT(&image);
    image.format = DEFREC_FORMAT_GRAY8;
    image.width = kWidth;
    image.height = kHeight;
    image.pixels = pixels.data();
    return image;
}

defrec_rig_desc rectified_pair() {
    defrec_rig_desc desc;
    DEFREC_INIT(&desc);
    desc.width = kWidth;
    desc.height = kHeight;
    desc.left.fx = desc.left.fy = kFocalLength;
    desc.left.cx = (kWidth - 1) / 2.0;
    desc.left.cy = (kHeight - 1) / 2.0;
    desc.right = desc.left;
    desc.rotation[0] = desc.rotation[4] = desc.rotation[8] = 1;
    desc.translation[0] = -kBaseline;
    return desc;
}

}  // namespace

int main() {
    std::vector<uint8_t> left(kWidth * kHeight), right(kWidth * kHeight);
    std::mt19937 random(1);
    for (uint32_t y = 0; y < kHeight; ++y) {
        std::vector<uint8_t> texture(kWidth + kDisparity);
        for (uint8_t& value : texture) value = static_cast<uint8_t>(20 + random() % 180);
        for (uint32_t x = 0; x < kWidth; ++x) {
            left[y * kWidth + x] = texture[x];
            right[y * kWidth + x] = texture[x + kDisparity];
        }
    }

    defrec_context context;
    if (defrec_context_create(nullptr, &context) < 0) return fail("context");
    const defrec_rig_desc pair = rectified_pair();
    defrec_rig rig;
    if (defrec_rig_create(context, &pair, &rig) < 0) return fail("rig");
    defrec_tracker_desc desc;
    DEFREC_INIT(&desc);
    desc.device_id = "cpu";
    desc.format = DEFREC_FORMAT_GRAY8;
    defrec_tracker tracker;
    if (defrec_tracker_create(context, rig, &desc, &tracker) < 0) return fail("tracker");

    const defrec_image left_image = gray(left), right_image = gray(right);
    defrec_frame frame;
    DEFREC_INIT(&frame);
    frame.left = &left_image;
    frame.right = &right_image;
    defrec_result result;
    DEFREC_INIT(&result);
    defrec_job job = nullptr;
    for (int i = 0; i < 3; ++i) {
        defrec_job_release(job);
        frame.timestamp_ns += 33333333;
        if (defrec_tracker_submit(tracker, &frame, &job) < 0) return fail("submit");
        if (defrec_job_wait(job, UINT64_MAX) < 0) return fail("wait");
        if (defrec_job_result(job, &result) < 0) return fail("result");
    }
    const double depth = kFocalLength * kBaseline / kDisparity,
                 quarter_pixel = depth / kDisparity / 4;
    double farthest = 0;
    unsigned observed = 0;
    for (uint64_t i = 0; i < result.vertex_count; ++i) {
        if (result.vertex_status[i] != DEFREC_POINT_OBSERVED) continue;
        ++observed;
        farthest = std::fmax(farthest, std::fabs(result.vertices[3 * i + 2] - depth));
    }
    std::printf("state %u, %u vertices observed, at most %.3f mm off the plane\n", result.state,
                observed, farthest);
    const bool good = result.state == DEFREC_TRACKING && observed > result.vertex_count / 2 &&
                      farthest < quarter_pixel;
    defrec_job_release(job);
    defrec_tracker_destroy(tracker);
    defrec_rig_destroy(rig);
    defrec_context_destroy(context);
    return good ? 0 : 1;
}
