// CAB_API marks what a shared libcab exports.
#pragma once

#define CAB_API __attribute__((visibility("default")))
