// SPDX-License-Identifier: Apache-2.0
// An empty library named like Fast DDS, for process_test.cpp.

extern const int hotpath_no_fastdds = 0;
