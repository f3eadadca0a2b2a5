// The exported functions for points at the time of display: check, catch, forward.
#include "sdk/api/call.hpp"
#include "sdk/api/objects.hpp"
#include "sdk/api/read.hpp"

using namespace defrec;

namespace {

bool is_followed(uint32_t state) {
    return state == DEFREC_TRACKING || state == DEFREC_DEGRADED || state == DEFREC_RELOCALISED;
}

void check_points(const Predictor& predictor, uint64_t count, const char* name) {
    if (count != predictor.point_count())
        fail(DEFREC_ERROR_ARGUMENT, name, " is ", count, "; the predictor has ",
             predictor.point_count(), " points");
}

FollowedPoints points_of(const defrec_predictor_frame& frame) {
    FollowedPoints points;
    points.time_ns = frame.timestamp_ns;
    points.is_followed = is_followed(frame.state);
    points.epoch = frame.epoch;
    points.xyz = frame.xyz;
    points.status = frame.status;
    points.expected_error_mm = frame.expected_error_mm;
    if (points.is_followed) {
        expect_given("frame.xyz", frame.xyz);
        expect_given("frame.status", frame.status);
    }
    return points;
}

}  // namespace

extern "C" {

defrec_status defrec_predictor_create(const defrec_predictor_desc* desc, defrec_predictor* out) {
    return api_call([&] {
        expect_given("out", out);
        const defrec_predictor_desc read = read_complete(desc);
        *out = add_handle<defrec_predictor>(
            std::make_shared<PredictorObject>(static_cast<size_t>(read.point_count)));
    });
}

void defrec_predictor_destroy(defrec_predictor predictor) {
    if (predictor != nullptr) api_call([&] { remove_handle(predictor); });
}

defrec_status defrec_predictor_add_frame(defrec_predictor predictor,
                                         const defrec_predictor_frame* frame) {
    return api_call([&] {
        const auto object = find_handle(predictor);
        const auto given = read_struct<defrec_predictor_frame>("frame", frame);
        if (given.reserved != 0)
            fail(DEFREC_ERROR_ARGUMENT, "frame.reserved is ", given.reserved, ", 0 expected");
        check_points(object->predictor, given.count, "frame.count");
        const std::lock_guard lock(object->inside);
        object->predictor.add_frame(points_of(given));
    });
}

defrec_status defrec_predictor_predict(defrec_predictor predictor, int64_t timestamp_ns,
                                       size_t count, double* xyz, uint8_t* status,
                                       double* expected_error_mm, uint8_t* basis) {
    return api_call([&] {
        const auto object = find_handle(predictor);
        check_points(object->predictor, count, "count");
        expect_given("xyz", xyz);
        const std::lock_guard lock(object->inside);
        object->predictor.predict(timestamp_ns, {xyz, status, expected_error_mm, basis});
    });
}

}  // extern "C"
