// SPDX-License-Identifier: Apache-2.0
namespace hotpath {

struct Record {
  int a = 1, b = 2;
  int value() const { return a + b; }
};

int other_value() { return Record().value(); }

}  // namespace hotpath
