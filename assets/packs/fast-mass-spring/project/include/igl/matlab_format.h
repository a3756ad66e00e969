// Included by files of the course; nothing of it is used.
#pragma once
