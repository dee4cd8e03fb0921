// SPDX-License-Identifier: Apache-2.0
// A library with the name of Fast DDS, for process_test.cpp.

extern const int hotpath_no_fastdds = 0;
