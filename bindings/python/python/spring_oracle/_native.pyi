from typing import Any, Callable

__version__: str

def check_jacobian(
    value: Callable[..., Any], jacobian: Callable[..., Any], kind: str, shape: tuple[int, int], settings: dict[str, Any]
) -> dict[str, Any]: ...
