// See one_view_twice.hpp.
#include "sdk/doctor/one_view_twice.hpp"

#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/sentence.hpp"

namespace defrec::cli {

double difference_of_views(const GrayPair& pair) {
    return cv::norm(pair.left, pair.right, cv::NORM_L1) / static_cast<double>(pair.left.total());
}

Finding look_at_one_view_twice(const Evidence& evidence) {
    Look look("one_view_twice", "two views", Severity::kError);
    double difference = 0;
    for (const GrayPair& pair : evidence.pairs)
        difference += difference_of_views(pair) / static_cast<double>(evidence.pairs.size());
    look.measured(difference, "gray levels");
    if (difference >= decisions::DoctorViews::kSameView)
        return look.fine("left and right are different images");
    return look.found(kOneViewTwice, kOneViewRemedy);
}

}  // namespace defrec::cli
