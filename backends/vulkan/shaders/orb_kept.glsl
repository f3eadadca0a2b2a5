// Which of the four corners that share a word of distances are kept. Who includes it has distances
// and corners as buffers of words.
bvec4 kept_of(int word, int min_distance, uint min_score) {
    const ivec4 distance = bytes_from(uvec3(distances[word], 0, 0), 0);
    bvec4 kept;
    for (int i = 0; i < 4; ++i) {
        const int cell = 4 * word + i;
        kept[i] = cell < push.cells &&
                  (distance[i] >= min_distance ||
                   (distance[i] == min_distance - 1 && corners[cell] >> 16 >= min_score));
    }
    return kept;
}
