// Whether the template that the tracker captured by itself is one by which frames are found, or was
// taken of a frame that shows less of the tissue than those after it.
#pragma once
#include <cstdint>

namespace defrec {

class TemplateTrial {
  public:
    // A template was captured of a frame with so many features. least: of a frame by which it is
    // judged, besides what `min_features` asks.
    void begin(uint32_t features, uint32_t least = 0);
    // Another template is followed, which the application chose.
    void end() { is_on_ = false; }

    // Once for each frame after the template's own whose images are of use: whether the surface was
    // found, and the features of its left image. true: the template is to be given up.
    bool add_frame(bool is_found, uint32_t features);

  private:
    bool is_on_ = false;
    bool was_found_ = false;  // in any frame after its own
    uint32_t features_ = 0;   // of its own frame
    uint32_t least_ = 0;
    uint32_t lost_ = 0;   // good frames since the surface was found last
    uint32_t found_ = 0;  // frames that show more than the template
};

}  // namespace defrec
