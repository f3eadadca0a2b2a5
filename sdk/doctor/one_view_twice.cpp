// Whether left and right are the same images.
#include "sdk/doctor/decisions.hpp"
#include "sdk/doctor/findings.hpp"
#include "sdk/doctor/sentence.hpp"

namespace defrec::cli {

Finding look_at_one_view_twice(const Evidence& evidence) {
    Look look("one_view_twice", "two views", Severity::kError);
    double difference = 0;
    for (const GrayPair& pair : evidence.pairs)
        difference += cv::norm(pair.left, pair.right, cv::NORM_L1) /
                      static_cast<double>(pair.left.total() * evidence.pairs.size());
    look.measured(difference, "gray levels");
    if (difference >= decisions::DoctorViews::kSameView)
        return look.fine("left and right are different images");
    return look.found("left and right are the same images.",
                      "Give the other view's recording as --right, or check that both video "
                      "inputs are not fed by one camera.");
}

}  // namespace defrec::cli
