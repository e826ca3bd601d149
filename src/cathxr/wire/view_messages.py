"""The messages by which clients see each other: who is there, what each looks at, whom one follows, what is locked."""

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field

from cathxr.wire.message import Message, Quaternion, Vector3

_FARTHEST = 1e6
_UNIT = 1e-2

ClientKind = Literal["desktop", "headset", "program"]
"""What a client is: a page on a screen, a page worn on the head, or a program that shows no view."""


def _near(values: Vector3) -> Vector3:
    if max(map(abs, values)) > _FARTHEST:
        raise ValueError(f"expected a position within {_FARTHEST:g}")
    return values


def _unit(values: Quaternion) -> Quaternion:
    if abs(sum(each * each for each in values) - 1.0) > _UNIT:
        raise ValueError("expected a unit quaternion")
    return values


def _from_list(value: object) -> object:
    """Return JSON's list as the tuple that is meant: strict validation takes no lists for tuples."""
    return tuple(value) if isinstance(value, list) else value


_Position = Annotated[Vector3, BeforeValidator(_from_list), AfterValidator(_near)]
_Orientation = Annotated[Quaternion, BeforeValidator(_from_list), AfterValidator(_unit)]


class HeadPose(Message):
    """Where a viewer's eyes are and where they look: a camera that looks along its own -z, with +y up."""

    position_mm: _Position = Field(description="mm, box")
    orientation_wxyz: _Orientation = Field(description="box_from_head as a unit quaternion")


class WorldPlacement(Message):
    """Where a headset's wearer has put the scene: scene_from_world, metres, y up; scale 1 is true size."""

    position_m: _Position
    orientation_wxyz: _Orientation
    scale: float = Field(gt=0.0, le=1e4)


# --- server to client -------------------------------------------------------------------------------------------------


class ClientDescription(Message):
    """One connected client."""

    id: str
    kind: ClientKind
    name: str = Field(description="For people, for example Headset 1; it changes when its kind does.")
    role: Literal["viewer", "operator"]


class ClientsMessage(Message):
    """Everybody who is connected, after every change. Which of them one is says `client` of `hello`."""

    type: Literal["clients"] = "clients"
    clients: list[ClientDescription]


class FollowingMessage(Message):
    """Whom this client follows now; sent as the answer to `follow`, and when the followed one has left."""

    type: Literal["following"] = "following"
    client: str | None = Field(description="The followed client's id; null: nobody.")
    sentence: str = Field(description="Why nobody is followed any more, or cannot be; empty otherwise.")


class ViewMessage(Message):
    """What the followed client looks at. Newest wins, at most ten a second."""

    type: Literal["view"] = "view"
    client: str = Field(description="Whose view it is.")
    settings: dict[str, Any] = Field(description="The scene's settings as that client has them.")
    head: HeadPose | None
    world: WorldPlacement | None


class LockMessage(Message):
    """Settings of the scene that are held fast for every client; whoever connects is given it. Empty: none are."""

    type: Literal["lock"] = "lock"
    values: dict[str, Any] = Field(description="The settings, by key, with the values that they are held at.")
    sentence: str = Field(description="Why, for the person who would like to change them.")


# --- client to server -------------------------------------------------------------------------------------------------


class ViewReport(Message):
    """What this client looks at, for those who follow it: to be sent after changes, at most ten times a second."""

    type: Literal["view"] = "view"
    kind: Literal["desktop", "headset"]
    settings: dict[str, Any] = Field(description="The scene's settings; the server hands them on as they are.")
    head: HeadPose | None = Field(default=None, description="Null where there is no view in space.")
    world: WorldPlacement | None = Field(default=None, description="Null on a screen.")


class Follow(Message):
    """Asks for another client's views, instead of those asked for before; null: for nobody's."""

    type: Literal["follow"] = "follow"
    client: str | None = Field(max_length=16, description="Its id, from `clients`.")
