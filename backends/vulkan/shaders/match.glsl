// What the shaders of stage match share. A descriptor's neighbours are compared by keys, distance << 16 | index: the least key is the
// nearest, then the first.
struct Sizes {
    uint landmarks;
    uint features;  // most live ones
    uint feature_splits, landmark_splits;  // parts that are searched side by side
};

const uint kNoKey = 0xffffffffu;
