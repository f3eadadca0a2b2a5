// Sums over the square windows of a tile of 32 x 32 pixels, of the radius kRadius: along rows into
// shared memory, then each invocation runs down 8 pixels of a column.
layout(local_size_x = 32, local_size_y = 4) in;

const int kTile = 32, kInvocations = 128, kRun = 8;
const int kSide = kTile + 2 * kRadius;  // of a tile with its windows
const int kReach = kRun + 2 * kRadius;  // of a run with its windows

int cell(ivec2 at);  // the summand of a pixel; 0 outside the image

shared int cells[kSide][kSide + 1];
shared int row_sums[kSide][kTile + 1];

// The windows along a line of kReach numbers.
void sum_run(int line[kReach], out int sums[kRun]) {
    int sum = 0;
    [[unroll]] for (int i = 0; i < 2 * kRadius; ++i) sum += line[i];
    [[unroll]] for (int i = 0; i < kRun; ++i) {
        sum += line[i + 2 * kRadius];
        sums[i] = sum;
        sum -= line[i];
    }
}

// sums: of the invocation's pixels, from top to bottom.
void sum_windows(out int sums[kRun]) {
    const ivec2 first = ivec2(gl_WorkGroupID.xy) * kTile - kRadius;
    const int me = int(gl_LocalInvocationIndex);
    for (int i = me; i < kSide * kSide; i += kInvocations)
        cells[i / kSide][i % kSide] = cell(first + ivec2(i % kSide, i / kSide));
    barrier();
    int line[kReach];
    for (int i = me; i < kSide * (kTile / kRun); i += kInvocations) {
        const int row = i % kSide, column = i / kSide * kRun;
        [[unroll]] for (int u = 0; u < kReach; ++u) line[u] = cells[row][column + u];
        sum_run(line, sums);
        [[unroll]] for (int u = 0; u < kRun; ++u) row_sums[row][column + u] = sums[u];
    }
    barrier();
    const int x = int(gl_LocalInvocationID.x), y = kRun * int(gl_LocalInvocationID.y);
    [[unroll]] for (int v = 0; v < kReach; ++v) line[v] = row_sums[y + v][x];
    sum_run(line, sums);
}

// The first of the invocation's pixels.
ivec2 first_of_run() {
    return ivec2(gl_WorkGroupID.xy) * kTile +
           ivec2(gl_LocalInvocationID.x, kRun * gl_LocalInvocationID.y);
}
